//! A dirty image that is made while the set is read.

use super::held::{Held, SINGLE};
use super::image::{InputFormat, fits};
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::fourier::{BandSize, TransformSize};
use crate::imaging::{Field, Outlook, rows_of_one_pass};

impl Held<'_> {
    /// The forecast of such an image. Its restoring beam is made after it, from the weights of the rows. `shared` is what a process has of the planes, where several
    /// share them, and the work of the busiest over its fair share: the others wait for it.
    pub(super) fn in_one_pass(self, format: InputFormat, shared: Option<(BandSize, f64)>) -> Forecast {
        let outlook = self.outlook;
        let (shared, busiest) = (shared.map(|(size, _)| size), shared.map_or(1.0, |(_, busiest)| busiest));
        let rows = rows_of_one_pass(outlook.blocks.0 as usize, outlook.processes) as u64;
        let o = Outlook {
            blocks: (rows, outlook.shape.0.div_ceil(rows.max(1))),
            image: Field {
                bands: shared,
                pass: outlook.image.pass.busier(busiest),
                size: TransformSize { groups: 1, ..outlook.image.size },
                ..outlook.image
            },
            ..outlook.clone()
        };
        let held = Held { outlook: &o, ..self };
        let (image, made) = (&o.image, held.plane(SINGLE));
        let planes = shared.map_or(image.size.group_bytes as f64, |b| b.bytes);
        let read = held.read(format);
        let bytes = held.weights_only() + planes + held.reading_to_grid(shared.is_some()).max(made);
        let sorting = (Term::Sort, image.pass.nodes);
        // Values that are in the cache need not be filled in from memory, and no later pass reads them.
        let gridded = held.gridded(image, 1.0).into_iter().filter(|(term, _)| !matches!(term, Term::Fill | Term::Again));
        // Nodes are sent once and as they are, and so are the columns of the image and the image: a byte takes a quarter of the time of one that is summed.
        let nodes = image.pass.nodes * 2.0 * image.real_bytes as f64;
        let summed_bytes = if o.processes == 1 { 0.0 } else { shared.map_or(made, |b| (nodes + b.all_bytes + made) / 4.0) };
        let read = Stage { bytes, summed_bytes, ..read }.doing([sorting]).doing(gridded.collect::<Vec<_>>());
        let field = o.core.as_ref().unwrap_or(image);
        let beam = held.beam(field, made);
        let beam = Stage { bytes: beam.bytes - held.data(true) + held.weights_only(), ..beam };
        let written = held.weights_only() + made;
        Forecast {
            stages: vec![held.start(), read, beam, held.write(1.0, written)],
            output_bytes: fits(&o, 1.0),
            groups_of_planes: 1,
            assumptions: Vec::new(),
        }
    }
}
