//! Centres of known arrays, for Measurement Sets that do not state the centre. The definition has no place for it.

/// Name, and geocentric coordinates in m to the millimetre. From the Observatories table of casacore and the site registry of astropy.
/// pyuvdata uses the same values, so positions relative to the centre agree with pyuvdata.
const OBSERVATORIES: [(&str, [f64; 3]); 18] = [
    ("ACA", [2_225_066.246, -5_440_107.534, -2_481_532.701]),
    ("ALMA", [2_225_142.180, -5_440_307.370, -2_481_029.852]),
    ("ASKAP", [-2_558_266.718, 5_095_672.177, -2_849_020.838]),
    ("ATA", [-2_524_087.896, -4_123_458.942, 4_147_779.692]),
    ("ATCA", [-4_750_915.837, 2_792_906.182, -3_200_483.747]),
    ("CARMA", [-2_397_389.652, -4_482_068.563, 3_843_528.415]),
    ("EVLA", [-1_601_190.000, -5_041_980.000, 3_554_880.000]),
    ("GMRT", [1_657_069.565, 5_797_969.000, 2_073_044.092]),
    ("HERA", [5_109_700.537, 2_005_356.584, -3_240_144.370]),
    ("LOFAR", [3_826_577.110, 461_022.900, 5_064_892.758]),
    ("MEERKAT", [5_109_217.421, 2_006_797.675, -3_239_133.867]),
    ("MWA", [-2_559_454.080, 5_095_372.146, -2_849_057.186]),
    ("NOEMA", [4_523_932.577, 468_134.733, 4_460_286.496]),
    ("OVRO-LWA", [-2_409_247.204, -4_477_889.562, 3_839_327.828]),
    ("PAPER", [5_109_342.760, 2_005_241.904, -3_239_939.469]),
    ("SMA", [-5_464_555.493, -2_492_927.989, 2_150_797.176]),
    ("VLA", [-1_601_185.365, -5_041_977.547, 3_554_875.870]),
    ("WSRT", [3_828_488.864, 443_253.420, 5_064_977.777]),
];

/// Geocentric coordinates of an array by its name, m.
pub(super) fn center_m(telescope: &str) -> Option<[f64; 3]> {
    OBSERVATORIES.iter().find(|o| o.0.eq_ignore_ascii_case(telescope.trim())).map(|o| o.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::Site;

    #[test]
    fn every_array_stands_on_the_ground() {
        for (name, xyz) in OBSERVATORIES {
            let altitude = Site::from_ecef_m(xyz).altitude_m;
            assert!((0.0..5200.0).contains(&altitude), "{name} {altitude}");
        }
        assert!(center_m("mwa").is_some() && center_m("SPIRAL").is_none());
    }
}
