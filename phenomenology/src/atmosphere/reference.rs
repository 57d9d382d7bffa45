//! The table of the ten reference atmospheres.

use super::error::{PhysicsError, find_by_name};
use super::profile::Profile;

/// A row of the table of reference atmospheres.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceAtmosphere {
    /// Name of the atmosphere.
    pub name: &'static str,
    /// Climate, for help texts and the book.
    pub summary: &'static str,
    /// Source of the numbers.
    pub reference: &'static str,
    csv: &'static str,
}

const AFGL: &str = "Anderson et al. 1986, AFGL-TR-86-0110";
const SMARTS: &str = "Gueymard, SMARTS 2.9.5 reference atmospheres";

macro_rules! row {
    ($name:literal, $summary:literal, $reference:expr) => {
        ReferenceAtmosphere {
            name: $name,
            summary: $summary,
            reference: $reference,
            csv: include_str!(concat!("../../tables/atmospheres/", $name, ".csv")),
        }
    };
}

/// Every reference atmosphere, 0-30 km; the first is the default.
pub const ATMOSPHERES: &[ReferenceAtmosphere] = &[
    row!("ussa", "U.S. Standard 1976", AFGL),
    row!("trl", "tropical, 15 N, annual", AFGL),
    row!("mls", "mid-latitude summer, 45 N, July", AFGL),
    row!("mlw", "mid-latitude winter, 45 N, January", AFGL),
    row!("sas", "sub-arctic summer, 60 N, July", AFGL),
    row!("saw", "sub-arctic winter, 60 N, January", AFGL),
    row!("sts", "sub-tropical summer, 30 N, July", SMARTS),
    row!("stw", "sub-tropical winter, 30 N, January", SMARTS),
    row!("as", "arctic summer, 75 N, July", SMARTS),
    row!("aw", "arctic winter, 75 N, January", SMARTS),
];

/// Finds a reference atmosphere by name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn reference_profile(name: &str) -> Result<Profile, PhysicsError> {
    let entry = find_by_name("atmosphere", name, ATMOSPHERES, |e| e.name)?;
    Profile::from_csv(entry.name, entry.csv)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published columns of water, kg/m2.
    #[test]
    fn columns_of_water_are_as_published() {
        let published = [
            ("ussa", 14.2),
            ("trl", 41.2),
            ("mls", 29.2),
            ("mlw", 8.5),
            ("sas", 20.8),
            ("saw", 4.2),
            ("sts", 42.1),
            ("stw", 20.7),
            ("as", 14.8),
            ("aw", 2.2),
        ];
        assert_eq!(published.len(), ATMOSPHERES.len());
        for (name, expected) in published {
            let water = reference_profile(name).unwrap().precipitable_water_kg_m2().unwrap();
            assert!((water - expected).abs() < 0.06, "{name}: {water} against {expected}");
        }
    }

    #[test]
    fn all_reach_thirty_kilometres() {
        for entry in ATMOSPHERES {
            let profile = reference_profile(entry.name).unwrap();
            assert_eq!((profile.bottom_km(), profile.top_km()), (0.0, 30.0));
            assert_eq!(profile.name(), entry.name);
        }
    }

    #[test]
    fn unknown_atmosphere_lists_the_known() {
        let message = reference_profile("mars").unwrap_err().to_string();
        assert!(message.contains("unknown atmosphere 'mars'; known: ussa, trl"), "{message}");
    }
}
