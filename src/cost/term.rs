//! The operations whose time is measured. One row each; the seconds are in `machines`.

/// Which of the short tests says how fast a machine is at an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Arithmetic within the caches, as in gridding.
    Grid,
    /// Fourier transforms.
    Fourier,
    /// Everything that goes through memory or the system once.
    Stream,
    /// No test: what takes about the same time on all machines.
    Same,
}

macro_rules! terms {
    ($($(#[doc = $what:literal])+ $name:ident = $text:literal, $kind:ident;)+) => {
        /// An operation whose time is measured.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Term {
            $($(#[doc = $what])+ $name,)+
        }

        impl Term {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$name,)+];

            /// Its name in the files of `machines` and in results: what is done, a point, and what is counted.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
                }
            }

            /// The short test that scales it.
            #[must_use]
            pub fn kind(self) -> Kind {
                match self {
                    $(Self::$name => Kind::$kind,)+
                }
            }
        }
    };
}

terms! {
    /// The start and the end of a program. They took 32 to 34 ms on three machines whose memories differ by a factor of 2.7.
    Command = "start.command", Same;
    /// Reading and reducing a value (one product of one channel of one row) of a UVH5 file.
    ReadUvh5 = "read.uvh5", Stream;
    /// The same of a UVFITS file.
    ReadUvfits = "read.uvfits", Stream;
    /// The same of a Measurement Set.
    ReadMs = "read.ms", Stream;
    /// Reading the baseline of a row.
    ReadRow = "read.row", Stream;
    /// Reading and reducing a value in a later pass over a set that does not stay in memory.
    Again = "again.value", Stream;
    /// Adding a visibility to the density of weights.
    Density = "weigh.density", Stream;
    /// A cell of the density.
    Cell = "weigh.cell", Stream;
    /// Weighing a visibility.
    Weigh = "weigh.value", Stream;
    /// Sorting a node into its tile.
    Sort = "pass.sort", Stream;
    /// Giving a visibility its weight on the way to the grid.
    Fill = "pass.value", Stream;
    /// A row on the way to the grid: where its values lie, and fetching them in the order of the grid.
    Row = "pass.row", Stream;
    /// A multiply-add between channels and nodes on the way to the grid.
    Fold = "pass.channel", Grid;
    /// A node on the way to the grid.
    Node = "pass.node", Grid;
    /// A multiply-add between a node and a cell on the way to the grid.
    Spread = "pass.cell", Grid;
    /// A visibility on the way from the grid.
    Subtract = "predict.value", Stream;
    /// A row on the way from the grid.
    RowBack = "predict.row", Stream;
    /// A multiply-add between channels and nodes on the way from the grid.
    Unfold = "predict.channel", Grid;
    /// A node on the way from the grid.
    NodeBack = "predict.node", Grid;
    /// A multiply-add between a cell and a node on the way from the grid.
    Gather = "predict.cell", Grid;
    /// A point of the planes of the grid, times log2 of the length of its transform, on the way to the image.
    ToImage = "to-image.log", Fourier;
    /// A point of the planes on the way to the image.
    ToImagePoint = "to-image.point", Stream;
    /// A point of the planes, times log2 of the length, on the way from the image.
    FromImage = "from-image.log", Fourier;
    /// A point of the planes on the way from the image.
    FromImagePoint = "from-image.point", Stream;
    /// A component of CLEAN.
    Component = "minor.component", Grid;
    /// A tile of the image, for each component of CLEAN by Högbom.
    Tile = "minor.tile", Grid;
    /// A pixel in a minor cycle.
    MinorPixel = "minor.pixel", Stream;
    /// A padded pixel times log2 of its number, in a convolution of images.
    Convolve = "convolve.log", Fourier;
    /// A pixel in one step over all pixels.
    Pixel = "image.pixel", Stream;
    /// A pixel that is written.
    WritePixel = "image.write", Stream;
    /// A pixel in one evaluation of maximum entropy, beside the transforms.
    EntropyPixel = "entropy.pixel", Stream;
    /// A visibility whose noise and flux are looked at before an image of maximum entropy.
    Statistics = "statistics.value", Stream;
    /// Adding a visibility to its cell of the u-v plane.
    Put = "cells.value", Grid;
    /// Writing a cell.
    WriteCell = "cells.write", Stream;
    /// A padded pixel times log2 of its number, in a map of uncertainties.
    EntropyMap = "map.log", Fourier;
    /// A visibility by whose residual a fit is judged.
    Judge = "judge.value", Stream;
    /// Dividing a value that is in memory by gains, or multiplying it.
    Apply = "gains.apply", Stream;
    /// Adding a value and its model to the sums of a gain solution.
    Sum = "gains.sum", Stream;
    /// A baseline in the gain solution of one interval.
    Solve = "gains.solve", Grid;
    /// Writing a value with other gains into a new set.
    WriteGains = "gains.write", Stream;
    /// The same into a copy of the file, which keeps what else the file holds.
    Edit = "gains.edit", Stream;
    /// The times and the gains of a row that is written with other gains.
    GainRow = "gains.row", Stream;
    /// A value that is simulated or predicted, beside the transform.
    Simulate = "simulate.value", Stream;
    /// The first phase of a source of a list in a row, from which those of its channels follow.
    Turn = "simulate.turn", Grid;
    /// A source of a list, for one visibility.
    Source = "simulate.source", Grid;
    /// A value that is written.
    WriteValue = "write.value", Stream;
    /// A row that is written.
    WriteRow = "write.row", Stream;
    /// Drawing a picture, whatever it shows.
    Picture = "picture.drawn", Stream;
    /// Reading and drawing a pixel of an image.
    PicturePixel = "picture.pixel", Stream;
    /// Convolving a pixel with the beam of another image, before it is drawn or compared.
    SmoothPixel = "picture.smooth", Stream;
    /// Reading a visibility of a picture.
    PictureValue = "picture.value", Stream;
}

impl Term {
    /// The group of operations that are divided among threads alike: the name before the point.
    #[must_use]
    pub fn group(self) -> &'static str {
        self.name().split_once('.').map_or(self.name(), |(group, _)| group)
    }

    /// True for the operations of the transforms and of whole images, whose number does not depend on that of the visibilities.
    #[must_use]
    pub fn is_of_images(self) -> bool {
        ["to-image", "from-image", "minor", "convolve", "image", "entropy", "map"].contains(&self.group()) || self == Self::Cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_differ_and_say_what_is_counted() {
        let names: BTreeSet<&str> = Term::ALL.iter().map(|t| t.name()).collect();
        assert_eq!(names.len(), Term::ALL.len());
        assert!(Term::ALL.iter().all(|t| t.name().split_once('.').is_some_and(|(group, what)| t.group() == group && !what.is_empty())));
    }
}
