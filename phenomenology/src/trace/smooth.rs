//! Smooth edges for the real-time mode.
//!
//! A pixel keeps its value if it differs little from its neighbours. Otherwise it becomes the mean of four looks, or of a grid of looks on
//! a strong edge. A look finds the first hit without radiometry. Most looks hit a face that one of the nine pixels around shows, and take
//! the temperature of that pixel. Where all nine show one face, a look must also agree with a pixel in the mirror. Only the others are followed as
//! full rays. A picture with error to spare follows fewer: one in each quarter of a pixel first, and the rest only if these differ; and none on
//! weak edges, where such a look takes the temperature of its pixel.

use super::around::{Around, Rough};
use super::edges::{Spreads, bend_k, limits};
use super::face::Face;
use super::lattice::{Points, Use};
use super::mesh_options::MeshOptions;
use super::scratch::Scratch;
use super::tracer::Tracer;
use crate::error::Result;
use crate::space::Vec3;
use rayon::prelude::*;

/// Positions of four looks in a pixel: one in each quarter of the columns and of the rows, as four rooks on a chess board.
const ROOKS: [(f64, f64); 4] = [(-0.375, -0.125), (-0.125, 0.375), (0.125, -0.375), (0.375, 0.125)];

/// A look at a face that no pixel around shows sends one of this many shares of the rays of a pixel.
const LOOK_SHARES: usize = 16;

/// A look for which no pixel around has the temperature.
#[derive(Debug, Clone, Copy)]
struct Open {
    face: Face,
    /// Where it lies in the pixel.
    offset: (f64, f64),
    along: Vec3,
}

impl Open {
    /// Whether another one lies in the same quarter of the pixel.
    fn is_beside(&self, other: &Self) -> bool {
        let quarter = |look: &Self| (look.offset.0 > 0.0, look.offset.1 > 0.0);
        quarter(self) == quarter(other)
    }
}

/// What is done for the looks of a pixel for which no pixel around has the temperature.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Whether they are followed. If not, only looks at the ground are, one for each surface: they show lines thinner than a pixel. Others take the temperature of the pixel.
    follow: bool,
    /// Whether those of a quarter share a followed ray where the quarters show nearly the same.
    share: bool,
}

/// Working memory of one thread.
struct Work {
    scratch: Scratch,
    spreads: Spreads,
    open: Vec<Open>,
    /// The first look at each face in each quarter of a pixel, and its temperature, K.
    first: Vec<(Open, f64)>,
    /// Number of looks that were followed.
    followed: usize,
}

impl Tracer<'_> {
    /// Writes the temperatures of a frame to `out`, with every pixel on an edge replaced by the mean of its looks. Returns the number of looks
    /// that were followed as full rays.
    pub(super) fn smooth_edges(&self, frame: &Rough<'_>, mesh: &MeshOptions, out: &mut [f64]) -> Result<usize> {
        let options = &mesh.edges;
        let side = options.strong_side;
        let columns = frame.view.grid().n_l;
        let limits = limits(frame.rj_k, columns, options);
        out.par_chunks_mut(columns)
            .zip(frame.rj_k.par_chunks(columns))
            .enumerate()
            .map_init(
                || Work { scratch: self.scratch(), spreads: Spreads::default(), open: Vec::new(), first: Vec::new(), followed: 0 },
                |work, (row, (out, line))| {
                    out.copy_from_slice(line);
                    work.followed = 0;
                    let mut spreads = std::mem::take(&mut work.spreads);
                    let spreads_k = if mesh.antialias { spreads.of_row(frame.rj_k, columns, row) } else { &[] };
                    for (column, &spread_k) in spreads_k.iter().enumerate().filter(|(_, spread_k)| **spread_k > options.weak_k) {
                        let around = Around::new(frame, columns, (column, row), options.alike_k);
                        let effort = Effort { follow: spread_k > limits.follow_k, share: limits.share };
                        if around.one_face && !effort.follow {
                            continue;
                        }
                        // A face that is curved or lit unevenly has no edge: its mean is the value in its middle.
                        if around.one_face && around.one_mirrored && bend_k(frame.rj_k, columns, (column, row)) <= options.weak_k {
                            continue;
                        }
                        out[column] = if spread_k > limits.strong_k {
                            let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
                            let looks = (0..side * side).map(|k| (offset(k % side), offset(k / side)));
                            self.mean_look(frame, &around, looks, effort, work)?
                        } else {
                            self.mean_look(frame, &around, ROOKS.into_iter(), effort, work)?
                        };
                    }
                    work.spreads = spreads;
                    out.iter_mut().for_each(|t| *t = self.scaled(0, 0, *t));
                    Ok(work.followed)
                },
            )
            .sum()
    }

    /// The mean of the looks at offsets from the centre of a pixel. A pixel with no look inside the hemisphere is 0 K.
    fn mean_look(
        &self,
        frame: &Rough<'_>,
        around: &Around<'_>,
        looks: impl Iterator<Item = (f64, f64)>,
        effort: Effort,
        work: &mut Work,
    ) -> Result<f64> {
        // If all nine pixels show one face, the edge is a mirrored one, and the first hit does not show it. On level ground the mirrored hit does;
        // on bodies, which may be curved, temperatures change too fast along one face in the mirror.
        let (one_face, one_mirrored) = (around.one_face, around.one_mirrored);
        let here = around.here.face;
        let block = frame.blocks.at(around.column, around.row);
        let (mut sum, mut count) = (0.0, 0_u32);
        work.open.clear();
        for offset in looks {
            let Some(along) = frame.view.along(around.column as f64 + offset.0, around.row as f64 + offset.1) else { continue };
            count += 1;
            let (face, known) = if one_face && (one_mirrored || !here.is_ground()) {
                (here, None)
            } else {
                let look = self.look(frame.view, along, block);
                let mirrored = if one_face { Some(self.mirrored(&look)?) } else { None };
                (look.face, around.near(look.face, mirrored, offset))
            };
            match known {
                Some(rj_k) => sum += rj_k,
                None if !effort.follow && !face.is_ground() => sum += around.rj_k,
                None => work.open.push(Open { face, offset, along }),
            }
        }
        if !work.open.is_empty() {
            sum += self.sum_of_open(frame, around, effort, work)?;
        }
        Ok(if count == 0 { 0.0 } else { sum / f64::from(count) })
    }

    /// The sum of the temperatures of the looks for which no pixel around has it.
    fn sum_of_open(&self, frame: &Rough<'_>, around: &Around<'_>, effort: Effort, work: &mut Work) -> Result<f64> {
        let open = std::mem::take(&mut work.open);
        let mut sum = 0.0;
        work.first.clear();
        for look in &open {
            if !work.first.iter().any(|(first, _)| first.face == look.face && (!effort.follow || first.is_beside(look))) {
                let rj_k = self.followed_look(frame, around, look, work)?;
                work.first.push((*look, rj_k));
            }
        }
        for look in &open {
            let same = || work.first.iter().filter(|(first, _)| first.face == look.face);
            let (low, high) = same().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, t)| (low.min(*t), high.max(*t)));
            let beside = same().find(|(first, _)| !effort.follow || first.is_beside(look));
            sum += match beside {
                Some((first, rj_k))
                    if !effort.follow
                        || first.offset == look.offset
                        || (effort.share && same().count() > 1 && high - low <= around.alike_k) =>
                {
                    *rj_k
                }
                _ => self.followed_look(frame, around, look, work)?,
            };
        }
        work.open = open;
        Ok(sum)
    }

    /// The temperature of a look that is followed as a full ray.
    fn followed_look(&self, frame: &Rough<'_>, around: &Around<'_>, look: &Open, work: &mut Work) -> Result<f64> {
        work.followed += 1;
        let (x, y) = (around.column as f64 + look.offset.0, around.row as f64 + look.offset.1);
        let (direction, points) = (frame.view.unit(look.along), Points::of_pixel(x, y));
        let block = frame.blocks.at(around.column, around.row);
        let bare = self.vertex(frame.view, direction, points.using(Use::Nothing), block, &mut work.scratch)?;
        match around.correction(&bare, look.offset) {
            Some(correction_k) => Ok(bare.rj_k + correction_k),
            None => Ok(self.vertex(frame.view, direction, points.share(0, LOOK_SHARES), block, &mut work.scratch)?.rj_k),
        }
    }
}
