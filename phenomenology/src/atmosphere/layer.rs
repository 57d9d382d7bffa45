//! Layers of cloud, fog, haze, ice and rain.

use std::fmt;
use std::str::FromStr;

use super::error::{PhysicsError, check_range};
use super::hydrosol::MAX_DENSITY_G_M3;

/// Content of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerKind {
    /// Cloud droplets.
    Cloud,
    /// Fog droplets.
    Fog,
    /// Haze droplets.
    Haze,
    /// Ice crystals.
    Ice,
    /// Rain.
    Rain,
}

/// The absorber of a layer. Layers of one phase must not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Suspended droplets.
    Droplets,
    /// Suspended ice crystals.
    Crystals,
    /// Falling rain.
    Rain,
}

/// A row of the table of layer kinds.
#[derive(Debug, Clone, Copy)]
pub struct LayerKindEntry {
    /// Name in layer texts.
    pub name: &'static str,
    /// The kind.
    pub kind: LayerKind,
    /// The phase, which decides the model.
    pub phase: Phase,
    /// Unit of the amount.
    pub unit: &'static str,
    /// Typical amounts, for help texts and the book.
    pub summary: &'static str,
}

/// Every kind of layer.
pub const LAYER_KINDS: &[LayerKindEntry] = &[
    LayerKindEntry {
        name: "cloud",
        kind: LayerKind::Cloud,
        phase: Phase::Droplets,
        unit: "g/m3",
        summary: "liquid cloud; stratus 0.1-0.4 g/m3, cumulus 0.3-1.0 g/m3",
    },
    LayerKindEntry { name: "fog", kind: LayerKind::Fog, phase: Phase::Droplets, unit: "g/m3", summary: "fog; 0.02-0.5 g/m3" },
    LayerKindEntry { name: "haze", kind: LayerKind::Haze, phase: Phase::Droplets, unit: "g/m3", summary: "haze; 0.001-0.02 g/m3" },
    LayerKindEntry { name: "ice", kind: LayerKind::Ice, phase: Phase::Crystals, unit: "g/m3", summary: "ice cloud; 0.001-0.5 g/m3" },
    LayerKindEntry {
        name: "rain",
        kind: LayerKind::Rain,
        phase: Phase::Rain,
        unit: "mm/h",
        summary: "rain; drizzle 0.25, light 1, moderate 4, heavy 16 mm/h and more",
    },
];

impl LayerKind {
    /// The row of this kind.
    #[must_use]
    pub fn entry(self) -> &'static LayerKindEntry {
        // The table has the order of the enum, which a test checks.
        &LAYER_KINDS[self as usize]
    }
}

/// A layer, uniform between its base and its top and absent elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    kind: LayerKind,
    base_km: f64,
    top_km: f64,
    amount: f64,
}

/// Highest top of a layer, km.
const MAX_TOP_KM: f64 = 30.0;
/// Highest rain rate of a layer, mm/h. A rain model may have a lower limit.
const MAX_RATE_MM_H: f64 = 300.0;

impl Layer {
    /// Builds a layer; `amount` is g/m3, or mm/h for rain.
    ///
    /// # Errors
    /// [`PhysicsError::Refused`] unless -1 km <= base < top <= 30 km;
    /// [`PhysicsError::OutOfRange`] for a negative or too large amount.
    pub fn new(kind: LayerKind, base_km: f64, top_km: f64, amount: f64) -> Result<Self, PhysicsError> {
        let layer = Self { kind, base_km, top_km, amount };
        if !(base_km >= -1.0 && base_km < top_km && top_km <= MAX_TOP_KM) {
            return Err(layer.extent_error(-1.0, MAX_TOP_KM));
        }
        match kind.entry().phase {
            Phase::Rain => check_range("rain rate", amount, "mm/h", 0.0, MAX_RATE_MM_H)?,
            _ => check_range("water density", amount, "g/m3", 0.0, MAX_DENSITY_G_M3)?,
        };
        Ok(layer)
    }

    pub(super) fn extent_error(&self, min_km: f64, max_km: f64) -> PhysicsError {
        PhysicsError::Refused(format!("layer {self}: base and top must satisfy {min_km} km <= base < top <= {max_km} km"))
    }

    /// Content of the layer.
    #[must_use]
    pub fn kind(&self) -> LayerKind {
        self.kind
    }

    /// Height of the base, km.
    #[must_use]
    pub fn base_km(&self) -> f64 {
        self.base_km
    }

    /// Height of the top, km.
    #[must_use]
    pub fn top_km(&self) -> f64 {
        self.top_km
    }

    /// Amount: g/m3, or mm/h for rain.
    #[must_use]
    pub fn amount(&self) -> f64 {
        self.amount
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.kind.entry().phase == other.kind.entry().phase && self.base_km < other.top_km && other.base_km < self.top_km
    }
}

/// Checks that layers of one phase do not overlap. Cloud and rain may overlap.
///
/// # Errors
/// [`PhysicsError::Refused`] with both layers.
pub fn check_layers(layers: &[Layer]) -> Result<(), PhysicsError> {
    for (index, first) in layers.iter().enumerate() {
        for second in &layers[index + 1..] {
            if first.overlaps(second) {
                let rule = "layers of cloud, fog and haze (or two of ice, or two of rain) must not share heights, merge them into one";
                return Err(PhysicsError::Refused(format!("layers {first} and {second} overlap; {rule}")));
            }
        }
    }
    Ok(())
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = self.kind.entry();
        write!(f, "{}:{}km-{}km:{}{}", row.name, self.base_km, self.top_km, self.amount, row.unit)
    }
}

impl FromStr for Layer {
    type Err = PhysicsError;

    fn from_str(text: &str) -> Result<Self, PhysicsError> {
        let form = "expected KIND:BASE-TOP:AMOUNT such as cloud:0.5km-1.5km:0.2g/m3 or rain:0km-2km:5mm/h";
        let fault = |problem: String| PhysicsError::Refused(format!("layer '{text}': {problem}; {form}"));
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let [kind, heights, amount] = parts[..] else {
            return Err(fault(format!("{} parts where 3 are due", parts.len())));
        };
        let entry = LAYER_KINDS.iter().find(|e| e.name == kind).ok_or_else(|| {
            let known: Vec<_> = LAYER_KINDS.iter().map(|e| e.name).collect();
            fault(format!("unknown kind '{kind}', known are {}", known.join(", ")))
        })?;
        let (base, top) = split_heights(heights).ok_or_else(|| fault(format!("'{heights}' is not BASE-TOP with units km or m")))?;
        let amount = quantity(amount, &[(entry.unit, 1.0)])
            .ok_or_else(|| fault(format!("amount '{amount}' is not a number with {}", entry.unit)))?;
        Self::new(entry.kind, base, top, amount)
    }
}

/// `BASE-TOP` in km. The separating dash is the first dash that follows a unit.
fn split_heights(text: &str) -> Option<(f64, f64)> {
    let dash = text.match_indices('-').map(|(at, _)| at).find(|at| text[..*at].ends_with('m'))?;
    let units = [("km", 1.0), ("m", 1e-3)];
    Some((quantity(&text[..dash], &units)?, quantity(&text[dash + 1..], &units)?))
}

/// A number followed by one of the units. A number without unit gives `None`.
fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    units.iter().find_map(|(unit, factor)| {
        let number = text.trim().strip_suffix(unit)?.trim();
        Some(number.parse::<f64>().ok()? * factor)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_order_is_enum_order() {
        for entry in LAYER_KINDS {
            assert_eq!(entry.kind.entry().name, entry.name);
        }
    }

    #[test]
    fn text_round_trips() {
        for text in ["cloud:0.5km-1.5km:0.2g/m3", "rain:0km-2km:5mm/h", "ice:8km-9km:0.01g/m3"] {
            assert_eq!(text.parse::<Layer>().unwrap().to_string(), text);
        }
        let fog: Layer = "fog:0m-200m:0.2g/m3".parse().unwrap();
        assert_eq!(fog, Layer::new(LayerKind::Fog, 0.0, 0.2, 0.2).unwrap());
        let cold: Layer = "haze:-0.1km-1e-1km:0.01g/m3".parse().unwrap();
        assert_eq!((cold.base_km(), cold.top_km()), (-0.1, 0.1));
    }

    #[test]
    fn bad_texts_say_what_is_wrong() {
        let cases = [
            ("cloud", "1 parts where 3 are due"),
            ("smoke:0km-1km:1g/m3", "unknown kind 'smoke'"),
            ("cloud:0-1:1g/m3", "'0-1' is not BASE-TOP"),
            ("cloud:0km-1km:1", "amount '1' is not a number with g/m3"),
            ("rain:0km-1km:1g/m3", "is not a number with mm/h"),
            ("cloud:2km-1km:1g/m3", "base < top"),
            ("cloud:0km-40km:1g/m3", "top <= 30 km"),
            ("cloud:0km-1km:-1g/m3", "water density -1 g/m3 is outside"),
            ("cloud:NaNkm-1km:1g/m3", "base < top"),
            ("rain:0km-1km:nanmm/h", "rain rate NaN mm/h"),
        ];
        for (text, expected) in cases {
            let message = text.parse::<Layer>().unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }

    #[test]
    fn one_phase_must_not_overlap() {
        let parse = |texts: &[&str]| -> Vec<Layer> { texts.iter().map(|t| t.parse().unwrap()).collect() };
        let touching = parse(&["cloud:0km-1km:0.1g/m3", "fog:1km-2km:0.1g/m3"]);
        assert!(check_layers(&touching).is_ok());
        let in_rain = parse(&["rain:0km-4km:25mm/h", "cloud:1km-4km:0.3g/m3"]);
        assert!(check_layers(&in_rain).is_ok());
        let clash = parse(&["cloud:0km-1km:0.1g/m3", "fog:0.5km-2km:0.1g/m3"]);
        let message = check_layers(&clash).unwrap_err().to_string();
        assert!(message.contains("cloud:0km-1km:0.1g/m3 and fog:0.5km-2km:0.1g/m3 overlap"));
    }
}
