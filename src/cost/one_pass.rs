//! A dirty image that is made while the set is read.

use super::held::{Held, SINGLE};
use super::image::{InputFormat, fits};
use super::stage::{Forecast, Stage};
use super::term::Term;

impl Held<'_> {
    /// The forecast of such an image. Its restoring beam is made after it, from the weights of the rows.
    pub(super) fn in_one_pass(self, format: InputFormat) -> Forecast {
        let (o, image) = (self.outlook, &self.outlook.image);
        let (planes, made) = (image.size.group_bytes as f64, self.plane(SINGLE));
        let read = self.read(format);
        let bytes = self.weights_only() + planes + self.reading_to_grid().max(made);
        let sorting = (Term::Sort, image.pass.nodes);
        // Values that are in the cache need not be filled in from memory, and no later pass reads them.
        let gridded = self.gridded(image, 1.0).into_iter().filter(|(term, _)| !matches!(term, Term::Fill | Term::Again));
        let read = Stage { bytes, ..read }.doing([sorting]).doing(gridded.collect::<Vec<_>>());
        let field = o.core.as_ref().unwrap_or(image);
        let beam = self.beam(field, made);
        let beam = Stage { bytes: beam.bytes - self.data(true) + self.weights_only(), ..beam };
        let written = self.weights_only() + made;
        Forecast {
            stages: vec![self.start(), read, beam, self.write(1.0, written)],
            output_bytes: fits(o, 1.0),
            groups_of_planes: image.size.groups,
            assumptions: Vec::new(),
        }
    }
}
