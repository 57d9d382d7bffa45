//! The built-in layouts: real arrays, and classic shapes of millimetre-wave imagers.

use crate::{ArrayError, ArrayLayout, Result};

/// A built-in layout: one file of `layouts/` with its name and description.
#[derive(Debug, Clone, Copy)]
pub struct BuiltinLayout {
    /// Name of the layout.
    pub name: &'static str,
    /// Description, one line.
    pub description: &'static str,
    /// Frequency for which the sensitivities are valid, Hz; the default for figures of merit.
    pub freq_hz: f64,
    /// Its TOML text.
    pub toml: &'static str,
}

macro_rules! builtin {
    ($($name:literal, $freq_hz:literal, $description:literal;)*) => {
        /// All built-in layouts, in the order of the list for users.
        pub const BUILTIN_LAYOUTS: &[BuiltinLayout] = &[$(BuiltinLayout {
            name: $name,
            description: $description,
            freq_hz: $freq_hz,
            toml: include_str!(concat!("../layouts/", $name, ".toml")),
        }),*];
    };
}

builtin! {
    "vla-a", 10e9, "Karl G. Jansky Very Large Array, widest configuration, 36 km";
    "vla-b", 10e9, "Karl G. Jansky Very Large Array, 11 km";
    "vla-c", 10e9, "Karl G. Jansky Very Large Array, 3.4 km";
    "vla-d", 10e9, "Karl G. Jansky Very Large Array, most compact configuration, 1 km";
    "alma-cycle8.1", 100e9, "ALMA, cycle 8, most compact 12 m configuration";
    "alma-cycle8.5", 100e9, "ALMA, cycle 8, middle 12 m configuration";
    "meerkat", 1.28e9, "MeerKAT, 64 dishes in the Karoo";
    "ngvla-core", 27e9, "Next-generation VLA, core of 94 dishes";
    "eht-2017", 227e9, "Event Horizon Telescope of the 2017 campaign";
    "gmva-86ghz", 86e9, "Global Millimetre VLBI Array with ALMA and LMT";
    "vlba", 8.4e9, "Very Long Baseline Array, ten dishes across North America";
    "wsrt", 1.4e9, "Westerbork Synthesis Radio Telescope, a line of 14 dishes";
    "atca-6a", 5.5e9, "Australia Telescope Compact Array, 6 km east-west line";
    "sma-compact", 230e9, "Submillimeter Array, compact configuration";
    "pdbi-a", 100e9, "Plateau de Bure interferometer, widest configuration";
    "mm-y", 94e9, "Imager in an aperture plane: Y of 45 elements";
    "mm-ring", 94e9, "Imager in an aperture plane: ring of 59 elements";
    "mm-reuleaux", 94e9, "Imager in an aperture plane: Reuleaux triangle of 48 elements";
    "mm-spiral", 94e9, "Imager in an aperture plane: three-armed logarithmic spiral of 63 elements";
    "mm-t", 94e9, "Imager in an aperture plane: uniform T of 57 elements";
    "mm-u", 94e9, "Imager in an aperture plane: uniform U of 91 elements";
    "mm-golden", 94e9, "Imager in an aperture plane: golden-angle disc of 96 elements";
}

impl ArrayLayout {
    /// The built-in layout of that name, in upper or lower case.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones.
    pub fn builtin(name: &str) -> Result<Self> {
        let Some(found) = BuiltinLayout::find(name) else {
            let names: Vec<&str> = BUILTIN_LAYOUTS.iter().map(|b| b.name).collect();
            return Err(ArrayError::Name(format!("there is no built-in layout {name:?}: choose one of {}", names.join(", "))));
        };
        Self::from_toml(found.toml)
    }
}

impl BuiltinLayout {
    /// The entry of that name, in upper or lower case.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        BUILTIN_LAYOUTS.iter().find(|b| b.name.eq_ignore_ascii_case(name.trim()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LayoutFrame, Sensitivity};

    #[test]
    fn every_layout_reads_names_its_source_and_knows_its_dishes() {
        for b in BUILTIN_LAYOUTS {
            let layout = ArrayLayout::builtin(b.name).unwrap_or_else(|e| panic!("{}: {e}", b.name));
            assert!(layout.source.is_some(), "{}", b.name);
            assert!(layout.antennas().iter().all(|a| a.diameter_m.is_some() && a.sensitivity.is_some()), "{}", b.name);
            let back = ArrayLayout::from_toml(&layout.to_toml()).unwrap();
            assert_eq!(back.n_ant(), layout.n_ant());
        }
    }

    #[test]
    fn elements_of_imagers_fit_beside_each_other() {
        let imagers = BUILTIN_LAYOUTS.iter().filter(|b| b.freq_hz == 94e9);
        let mut n = 0;
        for b in imagers {
            let layout = ArrayLayout::builtin(b.name).unwrap();
            assert_eq!(layout.frame, LayoutFrame::Boresight);
            assert!((20..=100).contains(&layout.n_ant()), "{}", b.name);
            assert!(
                layout.antennas().iter().all(|a| matches!(a.sensitivity, Some(Sensitivity::TsysK(t)) if (500.0..=1000.0).contains(&t)))
            );
            let shortest = layout.extent().shortest_m;
            assert!(layout.antennas().iter().all(|a| a.diameter_m.unwrap() <= shortest), "{}: {shortest}", b.name);
            n += 1;
        }
        assert_eq!(n, 7);
    }

    #[test]
    fn arrays_have_the_size_they_are_known_for() {
        for (name, n_ant, longest_m) in [("vla-a", 27, 36.6e3), ("vla-d", 27, 1.03e3), ("meerkat", 64, 7.7e3), ("vlba", 10, 8.61e6)] {
            let layout = ArrayLayout::builtin(name).unwrap();
            assert_eq!(layout.n_ant(), n_ant);
            let longest = layout.extent().longest_m;
            assert!((longest / longest_m - 1.0).abs() < 0.02, "{name}: {longest}");
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        assert!(ArrayLayout::builtin("VLA-A").is_ok());
        let e = ArrayLayout::builtin("vla").unwrap_err().to_string();
        assert!(e.contains("vla-a") && e.contains("mm-golden"), "{e}");
    }
}
