//! Positions of observatories, for files that name an observatory instead of a position.

use crate::builtin;
use cittert_arrays::Site;
use std::sync::LazyLock;

static SITES: LazyLock<Vec<(String, Site)>> = LazyLock::new(|| {
    let site = |(name, lat, lon, altitude_m): (String, f64, f64, f64)| {
        (name.to_lowercase(), Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m })
    };
    builtin::rows(include_str!("observatories.csv")).into_iter().map(site).collect()
});

/// The site of an observatory by its name, or by the longest known name that it begins with (`ALMASD` is at ALMA), in upper or lower case.
#[must_use]
pub fn known_site(name: &str) -> Option<Site> {
    let name = name.trim().to_lowercase();
    let exact = SITES.iter().find(|(n, _)| *n == name);
    let part = || SITES.iter().filter(|(n, _)| n.len() > 2 && name.starts_with(n.as_str())).max_by_key(|(n, _)| n.len());
    exact.or_else(part).map(|(_, site)| *site)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_any_case_and_with_more_behind() {
        let alma = known_site("alma").unwrap();
        assert!((alma.latitude_rad.to_degrees() + 23.022_886).abs() < 1e-9 && (alma.altitude_m - 5056.8).abs() < 1e-9);
        assert_eq!(known_site("ALMASD"), Some(alma));
        assert!(known_site("Egbert").is_none() && known_site("Catalina").is_none() && known_site("").is_none());
        assert_eq!(SITES.len(), 53);
    }
}
