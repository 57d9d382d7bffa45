//! Writing the AIPS tables after the groups: AN (antennas), FQ (frequencies), SU (sources).

use super::annotations::mount_code;
use super::export::{Export, site};
use crate::fits::table::{Form, TableWriter};
use cittert_arrays::astrometry::{LocalSky, eop};
use cittert_arrays::{Antenna, ArrayError, PhaseCenter, PhaseCenterKind, Polarization, Sensitivity, Site, VisibilityHeader, XOrientation};

/// SEFD and temperature of each receiver, NaN where it is stated otherwise; `None` where none is stated.
fn receivers(header: &VisibilityHeader) -> Option<Vec<[f64; 2]>> {
    let of = |a: &Antenna| match a.receiver {
        Some(Sensitivity::SefdJy(v)) => [v, f64::NAN],
        Some(Sensitivity::TsysK(t)) => [f64::NAN, t],
        None => [f64::NAN; 2],
    };
    let antennas = header.layout.antennas();
    antennas.iter().any(|a| a.receiver.is_some()).then(|| antennas.iter().map(of).collect())
}

/// Rotation of the Earth, degrees per day.
const DEGREES_A_DAY: f64 = 360.985_643_859_3;

/// AIPS AN: `midnight_jd` is 0 h UTC of the reference date.
pub(super) fn antennas(header: &VisibilityHeader, export: &Export, midnight_jd: f64) -> Result<Vec<u8>, ArrayError> {
    let place = site(header);
    let all = header.layout.antennas();
    let name_width = all.iter().map(|a| a.name.chars().count()).max().unwrap_or(8).max(8);
    // What the receivers add to the autocorrelations, Jy at the middle of the band or K.
    let receivers = receivers(header);
    let mut columns = vec![
        ("ANNAME", Form::Text(name_width), ""),
        ("STABXYZ", Form::Double(3), "METERS"),
        ("ORBPARM", Form::Double(0), ""),
        ("NOSTA", Form::Int(1), ""),
        ("MNTSTA", Form::Int(1), ""),
        ("STAXOF", Form::Float(1), "METERS"),
        ("POLTYA", Form::Text(1), ""),
        ("POLAA", Form::Float(1), "DEGREES"),
        ("POLCALA", Form::Float(3), ""),
        ("POLTYB", Form::Text(1), ""),
        ("POLAB", Form::Float(1), "DEGREES"),
        ("POLCALB", Form::Float(3), ""),
        ("DIAMETER", Form::Float(1), "METERS"),
    ];
    if receivers.is_some() {
        columns.extend([("RCVRSEFD", Form::Double(1), "JY"), ("RCVRTEMP", Form::Double(1), "KELVIN")]);
    }
    let mut table = TableWriter::new("AIPS AN", columns);
    let linear =
        header.polarizations.iter().any(|p| matches!(p, Polarization::XX | Polarization::YY | Polarization::XY | Polarization::YX));
    let about = &header.annotations;
    // Without a stated direction, X is at 0 and Y at 90 degrees.
    let east = linear && about.x_orientation == Some(XOrientation::East);
    let (angle_a, angle_b) = if east { (90.0, 0.0) } else { (0.0, 90.0) };
    let (feed_a, feed_b) = if linear { ("X", "Y") } else { ("R", "L") };
    // For antennas all over the Earth the mean lies deep inside the Earth. Positions are then geocentric.
    let mut centre = place.to_ecef_m();
    let radius = centre.iter().map(|v| v * v).sum::<f64>().sqrt();
    let local = (6.3e6..6.5e6).contains(&radius);
    let (sin, cos) = if local { place.longitude_rad.sin_cos() } else { (0.0, 1.0) };
    let offset = if local { [0.0; 3] } else { std::mem::take(&mut centre) };
    for (k, (antenna, number)) in all.iter().zip(&export.numbers).enumerate() {
        let [x, y, z] = place.enu_to_ecef_offset(antenna.position_m);
        table.text(&antenna.name);
        // The x axis of the table points to the meridian of the array.
        table.numbers(&[x * cos + y * sin + offset[0], y * cos - x * sin + offset[1], z + offset[2]]);
        table.numbers(&[]);
        table.each(&[f64::from(*number), mount_code(header, k), 0.0]);
        table.text(feed_a);
        table.numbers(&[angle_a]);
        table.numbers(&[0.0; 3]);
        table.text(feed_b);
        table.numbers(&[angle_b]);
        table.numbers(&[0.0; 3]);
        table.numbers(&[antenna.diameter_m.unwrap_or(0.0)]);
        if let Some(receivers) = &receivers {
            table.each(&receivers[k]);
        }
    }
    let greenwich = Site { longitude_rad: 0.0, latitude_rad: 0.0, altitude_m: 0.0 };
    let sidereal = LocalSky::at(midnight_jd, &greenwich)?.lst_rad().to_degrees();
    let orientation = eop::at(midnight_jd);
    let date = crate::time::fits_date(midnight_jd).unwrap_or_default();
    let name = telescope(header);
    Ok(table.finish(|h| {
        for (key, value) in [("ARRAYX", centre[0]), ("ARRAYY", centre[1]), ("ARRAYZ", centre[2])] {
            h.real(key, value, "m");
        }
        h.real("GSTIA0", sidereal, "deg, sidereal time at Greenwich at 0 h of RDATE");
        h.real("DEGPDY", DEGREES_A_DAY, "deg/day");
        h.real("FREQ", export.windows.first_hz[0], "Hz");
        h.text("RDATE", date.get(..10).unwrap_or(""), "");
        h.real("POLARX", 0.0, "");
        h.real("POLARY", 0.0, "");
        h.real("UT1UTC", orientation.ut1_utc_s, "s");
        h.real("DATUTC", 0.0, "s");
        h.text("TIMESYS", "UTC", "");
        h.text("TIMSYS", "UTC", "");
        h.text("ARRNAM", name, "");
        h.text("XYZHAND", "RIGHT", "");
        h.text("FRAME", "ITRF", "");
        h.integer("NUMORB", 0, "");
        h.integer("NO_IF", export.windows.n_if as i64, "");
        h.integer("NOPCAL", 0, "");
        h.text("POLTYPE", if linear { "X-Y LIN" } else { "APPROX" }, "");
        h.integer("FREQID", 1, "");
        // Keywords of pyuvdata.
        if !about.mounts.is_empty() {
            h.logical("HASMNT", true, "mounts are known");
        }
        if linear && about.x_orientation.is_some() {
            h.logical("HASFEED", true, "angles of feeds are known");
        }
    }))
}

/// Name of the telescope, as it is written for other programs.
pub(super) fn telescope(header: &VisibilityHeader) -> &str {
    [header.telescope.as_str(), header.layout.name.as_str()].into_iter().find(|n| !n.is_empty()).unwrap_or("unknown")
}

/// AIPS FQ: offsets of the IFs from the reference frequency.
pub(super) fn frequencies(export: &Export) -> Vec<u8> {
    let w = &export.windows;
    let n = w.n_if;
    let mut table = TableWriter::new(
        "AIPS FQ",
        vec![
            ("FRQSEL", Form::Int(1), ""),
            ("IF FREQ", Form::Double(n), "HZ"),
            ("CH WIDTH", Form::Float(n), "HZ"),
            ("TOTAL BANDWIDTH", Form::Float(n), "HZ"),
            ("SIDEBAND", Form::Int(n), ""),
        ],
    );
    table.numbers(&[1.0]);
    table.numbers(&w.first_hz.iter().map(|f| f - w.first_hz[0]).collect::<Vec<_>>());
    table.numbers(&w.step_hz);
    table.numbers(&w.step_hz.iter().map(|s| s.abs() * w.n_freq as f64).collect::<Vec<_>>());
    table.numbers(&w.step_hz.iter().map(|s| s.signum()).collect::<Vec<_>>());
    table.finish(|h| h.integer("NO_IF", n as i64, ""))
}

/// AIPS SU: the phase centres of a file with several.
pub(super) fn sources(
    export: &Export,
    centers: &[PhaseCenter],
    midnight_jd: f64,
    header: &VisibilityHeader,
) -> Result<Vec<u8>, ArrayError> {
    let n = export.windows.n_if;
    let numbers = |name, form| (name, form, "");
    let mut table = TableWriter::new(
        "AIPS SU",
        vec![
            numbers("ID. NO.", Form::Int(1)),
            numbers("SOURCE", Form::Text(16)),
            numbers("QUAL", Form::Int(1)),
            numbers("CALCODE", Form::Text(4)),
            ("IFLUX", Form::Float(n), "JY"),
            ("QFLUX", Form::Float(n), "JY"),
            ("UFLUX", Form::Float(n), "JY"),
            ("VFLUX", Form::Float(n), "JY"),
            ("FREQOFF", Form::Double(n), "HZ"),
            ("BANDWIDTH", Form::Double(1), "HZ"),
            ("RAEPO", Form::Double(1), "DEGREES"),
            ("DECEPO", Form::Double(1), "DEGREES"),
            ("EPOCH", Form::Double(1), "YEARS"),
            ("RAAPP", Form::Double(1), "DEGREES"),
            ("DECAPP", Form::Double(1), "DEGREES"),
            ("LSRVEL", Form::Double(n), "M/SEC"),
            ("RESTFREQ", Form::Double(n), "HZ"),
            ("PMRA", Form::Double(1), "DEG/DAY"),
            ("PMDEC", Form::Double(1), "DEG/DAY"),
        ],
    );
    let sky = LocalSky::at(midnight_jd, &site(header))?;
    let zeros = vec![0.0; n];
    for c in centers {
        let PhaseCenterKind::Sidereal { ra_rad, dec_rad } = c.kind else { continue };
        let place = sky.apparent_place(ra_rad, dec_rad, &c.frame)?;
        table.numbers(&[c.id as f64]);
        table.text(&c.name);
        table.numbers(&[0.0]);
        table.text("");
        for _ in 0..5 {
            table.numbers(&zeros);
        }
        table.each(&[export.windows.step_hz[0].abs() * export.windows.n_freq as f64, ra_rad.to_degrees(), dec_rad.to_degrees()]);
        table.each(&[c.epoch.unwrap_or(2000.0), place.ra_rad.to_degrees(), place.dec_rad.to_degrees()]);
        table.numbers(&zeros);
        table.numbers(&export.windows.first_hz);
        table.each(&[0.0, 0.0]);
    }
    Ok(table.finish(|h| {
        h.integer("NO_IF", n as i64, "");
        h.text("VELTYP", "LSR", "");
        h.text("VELDEF", "RADIO", "");
        h.integer("FREQID", 1, "");
    }))
}
