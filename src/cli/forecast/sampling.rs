//! The work of `simulate` and `predict`: visibilities of a scene on given rows.

use super::waves::of_scene;
use crate::cli::failure::Result;
use crate::cost::SampledWork;
use crate::fourier::{GridOptions, UvwExtent};
use crate::imaging::RowSample;
use crate::nearfield::Surface;
use crate::simulate::{Method, SkyModel};
use cittert_arrays::VisibilityHeader;
use ndarray::Array2;
use serde_json::{Map, Value, json};

/// How a scene is sampled.
pub(in crate::cli) struct Sampling {
    /// Rows, of which the sample is a part.
    pub(in crate::cli) rows: f64,
    /// Channels, Hz.
    pub(in crate::cli) channels: Vec<f64>,
    /// Frequencies in a channel.
    pub(in crate::cli) subchannels: usize,
    /// Products.
    pub(in crate::cli) products: usize,
    /// Rows of a block.
    pub(in crate::cli) block_rows: usize,
    pub(in crate::cli) method: Method,
    pub(in crate::cli) epsilon: f64,
    pub(in crate::cli) no_w: bool,
}

impl Sampling {
    /// The work on a scene, for rows of which these uvw, m \[row, 3\], are a sample.
    ///
    /// # Errors
    /// No transform reaches epsilon.
    pub(in crate::cli) fn work(&self, sky: &SkyModel, uvw_m: Array2<f64>) -> Result<(SampledWork, Map<String, Value>)> {
        let (work, mut facts) = self.of_rows(sky);
        let mut work = SampledWork { sources: sky.sources.len() as f64, ..work };
        for image in &sky.images {
            let shape = image.data.shape();
            let planes = (shape[0] * shape[1]) as f64;
            work.pixels = (image.grid.n_l * image.grid.n_m) as f64;
            facts.insert("size".into(), json!([image.grid.n_l, image.grid.n_m]));
            if self.method == Method::Dft {
                work.exact = work.pixels * planes;
                continue;
            }
            // A transform has room for the rows of the next blocks.
            let extent = UvwExtent::of(uvw_m.view()).with_room();
            let used = 1.0;
            let factor = self.rows / uvw_m.nrows().max(1) as f64;
            let sample = RowSample { uvw_m: uvw_m.clone(), used, factor };
            let options = GridOptions {
                epsilon: self.epsilon,
                w_term: !self.no_w && self.method == Method::Degrid,
                divide_by_n: false,
                ..GridOptions::default()
            };
            let freq_hz: Vec<f64> = self.channels.iter().flat_map(|f| std::iter::repeat_n(*f, self.subchannels)).collect();
            let field = sample.field_for(&image.grid, &freq_hz, extent, (&options, None))?;
            facts.insert("grid".into(), json!([field.size.padded.0, field.size.padded.1]));
            facts.insert("w_planes".into(), field.size.planes.into());
            work.image = Some((field, planes));
        }
        Ok((work, facts))
    }

    /// The work on a scene that lies on a surface near the array of a set.
    ///
    /// # Errors
    /// A scene that does not fit the array.
    pub(in crate::cli) fn near_work(
        &self,
        sky: &SkyModel,
        surface: &Surface,
        header: &VisibilityHeader,
    ) -> Result<(SampledWork, Map<String, Value>)> {
        let (mut work, mut facts) = self.of_rows(sky);
        work.near = of_scene(sky, surface, header, (&self.channels, self.subchannels))?;
        for image in &sky.images {
            work.pixels = (image.grid.n_l * image.grid.n_m) as f64;
            facts.insert("size".into(), json!([image.grid.n_l, image.grid.n_m]));
        }
        facts.insert("points".into(), work.near.iter().map(|(_, points)| points).sum::<f64>().into());
        Ok((work, facts))
    }

    /// The rows without what the scene adds, and what is said of them.
    fn of_rows(&self, sky: &SkyModel) -> (SampledWork, Map<String, Value>) {
        let n = self.channels.len() as f64;
        let work = SampledWork {
            rows: self.rows,
            channels: n * self.subchannels as f64,
            channels_out: n,
            products: self.products as f64,
            block_rows: self.block_rows as f64,
            ..SampledWork::default()
        };
        let mut facts = Map::new();
        facts.insert("rows".into(), self.rows.into());
        facts.insert("channels".into(), self.channels.len().into());
        facts.insert("products".into(), self.products.into());
        facts.insert("sources".into(), sky.sources.len().into());
        (work, facts)
    }
}
