//! One header from those of several files, which must agree.
//!
//! A value that one file states and another does not is no difference: formats can hold different things. Only what changes the meaning of the
//! visibilities (unit, pedestal, pattern) must be stated by all or by none.

use super::axes::{self, Axis, Conflict};
use crate::{FormatError, Result};
use cittert_arrays::{ArrayLayout, Keyword, LayoutFrame, PhaseCenter, PhaseCenterKind, Polarization, SpectralWindow, VisibilityHeader};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::{Debug, Display};
use std::path::PathBuf;
use std::sync::Arc;

/// Largest difference of a coordinate of an antenna, m: UVFITS and Measurement Sets round it.
const SAME_PLACE_M: f64 = 1e-3;
/// Largest difference of a direction, rad.
const SAME_DIRECTION_RAD: f64 = 1e-9;
/// Largest relative difference of a temperature or a length.
const SAME_NUMBER: f64 = 1e-9;
/// Number of keywords that one note names.
const MOST_NAMED: usize = 5;

/// Places of what a file numbers in the joined set.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Places {
    /// Of its antennas; `None` where they are the same.
    pub(super) antennas: Option<Vec<u32>>,
    /// Of its phase centres.
    pub(super) centers: Vec<u16>,
    /// Of its channels.
    pub(super) channels: Arc<Vec<usize>>,
    /// Of its products.
    pub(super) products: Arc<Vec<usize>>,
}

/// The joined header.
pub(super) struct Agreed {
    pub(super) header: VisibilityHeader,
    /// Of each file.
    pub(super) places: Vec<Places>,
    pub(super) notes: Vec<String>,
}

/// Takes the headers of files in turn.
pub(super) struct Headers {
    names: Vec<PathBuf>,
    header: Option<VisibilityHeader>,
    /// Which file has stated a value that the first one has not.
    stated_by: HashMap<String, usize>,
    antennas: Vec<Option<Vec<u32>>>,
    centers: Vec<Vec<u16>>,
    spectra: Vec<SpectralWindow>,
    spectrum_of: Vec<usize>,
    products: Vec<Vec<Polarization>>,
    products_of: Vec<usize>,
    /// Keywords of which files state different values, with one such pair of files.
    unclear: BTreeMap<String, (usize, usize)>,
    history: HashSet<String>,
}

impl Headers {
    /// For files of these names.
    pub(super) fn new(names: Vec<PathBuf>) -> Self {
        Self {
            names,
            header: None,
            stated_by: HashMap::new(),
            antennas: Vec::new(),
            centers: Vec::new(),
            spectra: Vec::new(),
            spectrum_of: Vec::new(),
            products: Vec::new(),
            products_of: Vec::new(),
            unclear: BTreeMap::new(),
            history: HashSet::new(),
        }
    }

    /// Take the header of the next file.
    ///
    /// # Errors
    /// It does not agree with those before it. The error names two files and what differs.
    pub(super) fn add(&mut self, new: &VisibilityHeader) -> Result<()> {
        let k = self.spectrum_of.len();
        self.spectrum_of.push(place_or_push(&mut self.spectra, &new.spectrum));
        self.products_of.push(place_or_push(&mut self.products, &new.polarizations));
        let Some(mut have) = self.header.take() else {
            self.antennas.push(None);
            self.centers.push((0..new.phase_centers.len() as u16).collect());
            self.history.extend(new.history.iter().cloned());
            self.header = Some(new.clone());
            return Ok(());
        };
        self.same((0, k), "the unit", have.unit.name(), new.unit.name())?;
        self.same_if(have.telescope.eq_ignore_ascii_case(&new.telescope), (0, k), "the telescope", &have.telescope, &new.telescope)?;
        self.same((0, k), "the pattern of the elements", &have.layout.pattern, &new.layout.pattern)?;
        let near = |h: &VisibilityHeader| format!("{:?}", h.near_field);
        self.same_if(have.near_field == new.near_field, (0, k), "the range of the scene and the focus", &near(&have), &near(new))?;
        let pedestal = |h: &VisibilityHeader| h.pedestal_k.map_or("none".to_owned(), |t| format!("{t} K"));
        let alike = match (have.pedestal_k, new.pedestal_k) {
            (Some(a), Some(b)) => close(&a, &b),
            (a, b) => a == b,
        };
        self.same_if(alike, (0, k), "the pedestal that was removed", &pedestal(&have), &pedestal(new))?;
        for (what, have, new) in [
            ("the pedestal of the scene in K", &mut have.scene_pedestal_k, new.scene_pedestal_k),
            ("the width of the scene in rad", &mut have.scene_width_rad, new.scene_width_rad),
            ("the antenna temperature in K", &mut have.antenna_temperature_k, new.antenna_temperature_k),
        ] {
            self.settle(k, what, have, new.as_ref(), close)?;
        }
        if have.instrument.is_empty() {
            have.instrument.clone_from(&new.instrument);
        }
        let antennas = self.layout(k, &mut have.layout, &new.layout)?;
        self.annotations(k, &mut have, new, antennas.as_deref())?;
        let centers = self.phase_centers(k, &mut have.phase_centers, &new.phase_centers)?;
        self.antennas.push(antennas);
        self.centers.push(centers);
        for line in &new.history {
            if self.history.insert(line.clone()) {
                have.history.push(line.clone());
            }
        }
        self.header = Some(have);
        Ok(())
    }

    /// The joined header.
    ///
    /// # Errors
    /// Channels or products that cannot be put in one order.
    pub(super) fn agreed(mut self) -> Result<Agreed> {
        let Some(mut header) = self.header.take() else {
            return Err(FormatError::unsupported(std::path::Path::new(""), "no file of the set"));
        };
        let file_of = |of: &[usize], list: usize| of.iter().position(|l| *l == list).unwrap_or(0);
        let apart = |of: &[usize], c: Conflict| self.apart((file_of(of, c.lists.0), file_of(of, c.lists.1)), c.what);
        let spectrum: Axis<_> = axes::channels(&self.spectra).map_err(|c| apart(&self.spectrum_of, c))?;
        let products = axes::products(&self.products).map_err(|c| apart(&self.products_of, c))?;
        header.spectrum = spectrum.all.map_err(|e| FormatError::values(&self.names[0], e))?;
        header.polarizations = products.all;
        let mut notes = axes::seams(&header.spectrum, &spectrum.places);
        if let Some((_, (a, b))) = self.unclear.first_key_value() {
            let named: Vec<&str> = self.unclear.keys().take(MOST_NAMED).map(String::as_str).collect();
            let more = if self.unclear.len() > MOST_NAMED { ", ..." } else { "" };
            let files = format!("{} and {}", self.names[*a].display(), self.names[*b].display());
            notes.push(format!(
                "files state different values of these keywords, which are left out: {}{more} (as {files})",
                named.join(", ")
            ));
            header.annotations.keywords.retain(|name, _| !self.unclear.contains_key(name));
        }
        let shared = |lists: Vec<Vec<usize>>| lists.into_iter().map(Arc::new).collect::<Vec<_>>();
        let (channels, products) = (shared(spectrum.places), shared(products.places));
        let places = self.antennas.into_iter().zip(self.centers).enumerate().map(|(k, (antennas, centers))| Places {
            antennas,
            centers,
            channels: channels[self.spectrum_of[k]].clone(),
            products: products[self.products_of[k]].clone(),
        });
        Ok(Agreed { header, places: places.collect(), notes })
    }

    fn apart(&self, (a, b): (usize, usize), what: impl Into<String>) -> FormatError {
        FormatError::Apart { first: self.names[a].clone(), second: self.names[b].clone(), what: what.into() }
    }

    fn same<T: PartialEq + Display>(&self, files: (usize, usize), what: &str, a: T, b: T) -> Result<()> {
        self.same_if(a == b, files, what, &a, &b)
    }

    fn same_if(&self, same: bool, files: (usize, usize), what: &str, a: &dyn Display, b: &dyn Display) -> Result<()> {
        if same {
            return Ok(());
        }
        let advice = "parts of one set must agree in it: leave one of them out, or correct its header";
        Err(self.apart(files, format!("{what} is {a} in the first and {b} in the second; {advice}")))
    }

    /// Take a value that is not stated yet, and compare it with one that is.
    fn settle<T: Clone + Debug>(
        &mut self,
        k: usize,
        what: &str,
        have: &mut Option<T>,
        new: Option<&T>,
        same: impl Fn(&T, &T) -> bool,
    ) -> Result<()> {
        match (&*have, new) {
            (Some(a), Some(b)) if !same(a, b) => {
                let by = self.stated_by.get(what).copied().unwrap_or(0);
                self.same_if(false, (by, k), what, &format!("{a:?}"), &format!("{b:?}"))
            }
            (None, Some(b)) => {
                *have = Some(b.clone());
                self.stated_by.insert(what.to_owned(), k);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Compare two layouts. The result says where the antennas of the second are in the first, unless they are in the same places.
    fn layout(&mut self, k: usize, have: &mut ArrayLayout, new: &ArrayLayout) -> Result<Option<Vec<u32>>> {
        let frame = |layout: &ArrayLayout| match layout.frame {
            LayoutFrame::Boresight => "boresight".to_owned(),
            LayoutFrame::EastNorthUp(s) => {
                format!("at {:.7} deg, {:.7} deg, {:.3} m", s.latitude_rad.to_degrees(), s.longitude_rad.to_degrees(), s.altitude_m)
            }
        };
        let same_frame = match (have.site(), new.site()) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                // A millimetre on the ground is 1.6e-10 rad.
                let turned = [a.latitude_rad - b.latitude_rad, a.longitude_rad - b.longitude_rad];
                turned.iter().all(|t| t.abs() < 2e-10) && (a.altitude_m - b.altitude_m).abs() < SAME_PLACE_M
            }
            _ => false,
        };
        self.same_if(same_frame, (0, k), "the frame of the array", &frame(have), &frame(new))?;
        let names: HashMap<&str, usize> = have.antennas().iter().enumerate().map(|(i, a)| (a.name.as_str(), i)).collect();
        let of_new: HashSet<&str> = new.antennas().iter().map(|a| a.name.as_str()).collect();
        if let Some(missing) = have.antennas().iter().find(|a| !of_new.contains(a.name.as_str())) {
            return Err(self.apart(
                (0, k),
                format!("the antenna {:?} is in the first alone: parts of one set have one list of antennas", missing.name),
            ));
        }
        let mut antennas = have.antennas().to_vec();
        let mut places = Vec::with_capacity(new.n_ant());
        for b in new.antennas() {
            let Some(&i) = names.get(b.name.as_str()) else {
                let what = format!("the antenna {:?} is in the second alone: parts of one set have one list of antennas", b.name);
                return Err(self.apart((0, k), what));
            };
            let a = &mut antennas[i];
            let near = (0..3).all(|axis| (a.position_m[axis] - b.position_m[axis]).abs() < SAME_PLACE_M);
            let place = |p: [f64; 3]| format!("({:.4}, {:.4}, {:.4}) m", p[0], p[1], p[2]);
            let what = |of: &str| format!("the {of} of the antenna {:?}", b.name);
            self.same_if(near, (0, k), &what("position"), &place(a.position_m), &place(b.position_m))?;
            self.settle(k, &what("diameter in m"), &mut a.diameter_m, b.diameter_m.as_ref(), |x, y| (x - y).abs() < 1e-4 * x)?;
            self.settle(k, &what("sensitivity"), &mut a.sensitivity, b.sensitivity.as_ref(), |x, y| x == y)?;
            self.settle(k, &what("receiver"), &mut a.receiver, b.receiver.as_ref(), |x, y| x == y)?;
            self.settle(k, &what("error of the position in m"), &mut a.position_error_m, b.position_error_m.as_ref(), |x, y| x == y)?;
            places.push(i as u32);
        }
        if antennas != have.antennas() {
            let (source, aperture_m, pattern, mount) = (have.source.take(), have.aperture_m, std::mem::take(&mut have.pattern), have.mount);
            *have = ArrayLayout::from_data(have.name.clone(), have.frame, antennas).map_err(|e| FormatError::values(&self.names[k], e))?;
            (have.source, have.aperture_m, have.pattern, have.mount) = (source, aperture_m, pattern, mount);
        }
        let same = places.iter().enumerate().all(|(i, p)| i == *p as usize);
        Ok(if same { None } else { Some(places) })
    }

    fn annotations(&mut self, k: usize, have: &mut VisibilityHeader, new: &VisibilityHeader, antennas: Option<&[u32]>) -> Result<()> {
        self.settle(
            k,
            "the direction of the X feeds",
            &mut have.annotations.x_orientation,
            new.annotations.x_orientation.as_ref(),
            |a, b| a == b,
        )?;
        for (what, have, new) in [
            ("the mount", &mut have.annotations.mounts, &new.annotations.mounts),
            ("the station", &mut have.annotations.stations, &new.annotations.stations),
        ] {
            let in_order = |list: &[String]| -> Vec<String> {
                let Some(places) = antennas else { return list.to_vec() };
                let mut ordered = vec![String::new(); list.len()];
                list.iter().zip(places).for_each(|(item, place)| ordered[*place as usize].clone_from(item));
                ordered
            };
            let mut old = (!have.is_empty()).then(|| have.clone());
            let new = (!new.is_empty()).then(|| in_order(new));
            let clash = old.as_ref().zip(new.as_ref()).and_then(|(a, b)| a.iter().zip(b).position(|(a, b)| a != b));
            let of = clash.map_or(String::new(), |i| format!(" of antenna {i}"));
            match (clash, &old, &new) {
                (Some(i), Some(a), Some(b)) => {
                    let by = self.stated_by.get(what).copied().unwrap_or(0);
                    self.same_if(false, (by, k), &format!("{what}{of}"), &a[i], &b[i])?;
                }
                _ => self.settle(k, what, &mut old, new.as_ref(), |_, _| true)?,
            }
            *have = old.unwrap_or_default();
        }
        let same = |a: &Keyword, b: &Keyword| match (a, b) {
            (Keyword::Text(a), Keyword::Text(b)) => a.trim() == b.trim(),
            _ => a == b,
        };
        for (name, value) in &new.annotations.keywords {
            match have.annotations.keywords.get(name) {
                Some(old) if !same(old, value) => {
                    let by = self.stated_by.get(name).copied().unwrap_or(0);
                    self.unclear.entry(name.clone()).or_insert((by, k));
                }
                Some(_) => {}
                None => {
                    have.annotations.keywords.insert(name.clone(), value.clone());
                    self.stated_by.insert(name.clone(), k);
                }
            }
        }
        Ok(())
    }

    /// Where the phase centres of a file are in the list. One of the two lists must hold the other.
    fn phase_centers(&mut self, k: usize, have: &mut Vec<PhaseCenter>, new: &[PhaseCenter]) -> Result<Vec<u16>> {
        let find = |list: &[PhaseCenter], c: &PhaseCenter| {
            let same = |a: &&PhaseCenter| same_direction(a, c);
            let named = list.iter().position(|a| a.name == c.name && same(&a));
            named.or_else(|| list.iter().position(|a| same(&a)))
        };
        let alone = have.iter().find(|c| find(new, c).is_none());
        let extra = new.iter().find(|c| find(have, c).is_none());
        if let (Some(a), Some(b)) = (alone, extra) {
            let by = self.stated_by.get("the phase centres").copied().unwrap_or(0);
            self.same_if(false, (by, k), "the phase centre", &direction(a), &direction(b))?;
        }
        if extra.is_some() {
            self.stated_by.insert("the phase centres".into(), k);
        }
        let mut places = Vec::with_capacity(new.len());
        for c in new {
            let place = find(have, c).unwrap_or(have.len());
            if place == have.len() {
                let mut c = c.clone();
                if have.iter().any(|h| h.id == c.id) {
                    c.id = have.iter().map(|h| h.id).max().unwrap_or(0) + 1;
                }
                have.push(c);
            }
            places.push(place as u16);
        }
        Ok(places)
    }
}

fn place_or_push<T: PartialEq + Clone>(list: &mut Vec<T>, item: &T) -> usize {
    list.iter().position(|have| have == item).unwrap_or_else(|| {
        list.push(item.clone());
        list.len() - 1
    })
}

fn close(a: &f64, b: &f64) -> bool {
    (a - b).abs() <= SAME_NUMBER * a.abs().max(b.abs())
}

fn same_direction(a: &PhaseCenter, b: &PhaseCenter) -> bool {
    let turned = |x: f64, y: f64| {
        let d = (x - y).rem_euclid(std::f64::consts::TAU);
        d.min(std::f64::consts::TAU - d) < SAME_DIRECTION_RAD
    };
    let frames = a.frame.is_empty() || b.frame.is_empty() || a.frame.eq_ignore_ascii_case(&b.frame);
    match (a.kind, b.kind) {
        (PhaseCenterKind::Sidereal { ra_rad: r, dec_rad: d }, PhaseCenterKind::Sidereal { ra_rad, dec_rad }) => {
            frames && turned(r, ra_rad) && turned(d, dec_rad)
        }
        (PhaseCenterKind::Driftscan { az_rad: a, el_rad: e }, PhaseCenterKind::Driftscan { az_rad, el_rad }) => {
            turned(a, az_rad) && turned(e, el_rad)
        }
        (PhaseCenterKind::Unprojected, PhaseCenterKind::Unprojected) => true,
        _ => false,
    }
}

fn direction(c: &PhaseCenter) -> String {
    let of = |what: [&str; 2], x: f64, y: f64| {
        format!("{} ({} {:.7} deg, {} {:.7} deg)", c.name, what[0], x.to_degrees(), what[1], y.to_degrees())
    };
    match c.kind {
        PhaseCenterKind::Sidereal { ra_rad, dec_rad } => {
            let frame = if c.frame.is_empty() { String::new() } else { format!(" of {}", c.frame) };
            of(["RA", "Dec"], ra_rad, dec_rad) + &frame
        }
        PhaseCenterKind::Driftscan { az_rad, el_rad } => of(["azimuth", "elevation"], az_rad, el_rad),
        PhaseCenterKind::Unprojected => format!("{} (not phased to the sky)", c.name),
    }
}
