//! PNG files with a palette of at most 256 colours, a third of the size of files with red, green and blue for each pixel.
//!
//! Colours that many pixels share stay as they are: paper, ink, lines and the large areas of a map. The others are joined into boxes of similar
//! colours by median cut, and each box becomes its mean.
//!
//! # Reference
//! Heckbert 1982, Computer Graphics 16, 297.

use super::failed::plot_error;
use super::shape::Rgb;
use crate::Result;
use std::collections::HashMap;

/// Entries of a palette.
const ENTRIES: usize = 256;
/// Largest number of colours that are kept exactly where there are more than 256.
const EXACT: usize = 24;

/// A colour of the picture and the number of its pixels.
type Counted = (Rgb, u64);

/// The palette of a picture, and the entry of each of its colours.
struct Palette {
    entries: Vec<Rgb>,
    entry_of: HashMap<Rgb, u8>,
}

/// An RGB picture as a PNG with a palette.
///
/// # Errors
/// A failure of the encoder.
pub(super) fn indexed(width: usize, height: usize, rgb: &[u8]) -> Result<Vec<u8>> {
    let palette = Palette::of(rgb);
    let pixels: Vec<u8> = rgb.chunks_exact(3).map(|p| palette.entry_of.get(&[p[0], p[1], p[2]]).copied().unwrap_or(0)).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width as u32, height as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.entries.concat());
    encoder.set_compression(png::Compression::High);
    // Differences of palette entries mean nothing, so rows are stored as they are.
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header().map_err(plot_error)?;
    writer.write_image_data(&pixels).map_err(plot_error)?;
    writer.finish().map_err(plot_error)?;
    Ok(out)
}

impl Palette {
    fn of(rgb: &[u8]) -> Self {
        let mut counts: HashMap<Rgb, u64> = HashMap::new();
        let mut last: (Rgb, u64) = ([0; 3], 0);
        for p in rgb.chunks_exact(3) {
            let color = [p[0], p[1], p[2]];
            if color == last.0 {
                last.1 += 1;
                continue;
            }
            *counts.entry(last.0).or_default() += last.1;
            last = (color, 1);
        }
        *counts.entry(last.0).or_default() += last.1;
        let mut all: Vec<Counted> = counts.into_iter().filter(|c| c.1 > 0).collect();
        // The most frequent first, and a fixed order among equals, so that the same picture has the same bytes.
        all.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        let exact = if all.len() <= ENTRIES { all.len() } else { EXACT };
        let mut palette = Self { entries: Vec::new(), entry_of: HashMap::new() };
        for c in &all[..exact] {
            palette.add(std::slice::from_ref(c));
        }
        if exact < all.len() {
            boxes(all.split_off(exact), ENTRIES - exact).iter().for_each(|of_box| palette.add(of_box));
        }
        palette
    }

    /// One entry for all these colours: their mean.
    fn add(&mut self, colors: &[Counted]) {
        let total: u64 = colors.iter().map(|c| c.1).sum();
        let mean = [0, 1, 2].map(|k| {
            let sum: u64 = colors.iter().map(|c| u64::from(c.0[k]) * c.1).sum();
            ((sum + total / 2) / total.max(1)) as u8
        });
        let entry = self.entries.len() as u8;
        self.entries.push(mean);
        self.entry_of.extend(colors.iter().map(|c| (c.0, entry)));
    }
}

/// Divide colours into at most `n` boxes. The box with the largest spread, weighted by its pixels, is cut at its median each time.
fn boxes(colors: Vec<Counted>, n: usize) -> Vec<Vec<Counted>> {
    let spread = |of_box: &[Counted]| {
        let width = |k: usize| {
            let (low, high) = of_box.iter().fold((255, 0), |(l, h), c| (c.0[k].min(l), c.0[k].max(h)));
            high - low.min(high)
        };
        let axis = (0..3).max_by_key(|k| width(*k)).unwrap_or(0);
        let pixels: u64 = of_box.iter().map(|c| c.1).sum();
        // The few pixels of a colour bar need as many shades as the many of the map beside it.
        (f64::from(width(axis)) * (pixels as f64).powf(0.08), axis)
    };
    let mut all = vec![(spread(&colors), colors)];
    while all.len() < n {
        let Some(widest) = (0..all.len()).filter(|k| all[*k].1.len() > 1).max_by(|a, b| all[*a].0.0.total_cmp(&all[*b].0.0)) else { break };
        let ((_, axis), mut whole) = all.swap_remove(widest);
        whole.sort_by_key(|c| (c.0[axis], c.0));
        let half: u64 = whole.iter().map(|c| c.1).sum::<u64>() / 2;
        let mut below = 0;
        let cut = whole.iter().take_while(|c| {
            below += c.1;
            below <= half
        });
        let at = cut.count().clamp(1, whole.len() - 1);
        let upper = whole.split_off(at);
        all.push((spread(&whole), whole));
        all.push((spread(&upper), upper));
    }
    all.into_iter().map(|b| b.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(png: &[u8]) -> image::RgbImage {
        image::load_from_memory(png).unwrap().to_rgb8()
    }

    #[test]
    fn few_colours_stay_exactly_as_they_are() {
        let rgb: Vec<u8> = (0..40 * 30).flat_map(|k| [(k % 250) as u8, 7, 200]).collect();
        assert_eq!(read(&indexed(40, 30, &rgb).unwrap()).into_raw(), rgb);
    }

    #[test]
    fn many_colours_become_similar_ones_and_frequent_ones_stay() {
        // A third of the picture is white, the rest has 30,000 colours on a smooth surface.
        let color = |k: usize| if k.is_multiple_of(3) { [255; 3] } else { [(k / 300) as u8, (k % 300 / 2) as u8, (k / 500) as u8] };
        let rgb: Vec<u8> = (0..300 * 200).flat_map(color).collect();
        let png = indexed(300, 200, &rgb).unwrap();
        let found = read(&png).into_raw();
        let mut squares = 0.0;
        for (a, b) in rgb.chunks_exact(3).zip(found.chunks_exact(3)) {
            if a == [255; 3] {
                assert_eq!(b, [255; 3]);
            }
            squares += a.iter().zip(b).map(|(x, y)| (f64::from(*x) - f64::from(*y)).powi(2)).sum::<f64>();
        }
        // 232 boxes over a surface of 200 by 150 levels are about 12 levels wide, which is an rms of 12 / sqrt(12) along each of two axes.
        let rms = (squares / (300.0 * 200.0)).sqrt();
        assert!(rms < 6.0, "{rms}");
        assert_eq!(png, indexed(300, 200, &rgb).unwrap());
    }
}
