//! The font of a PDF: the glyphs that a picture uses, cut out of the embedded font.

use super::canvas::FONT_BYTES;
use super::failed::plot_error;
use crate::Result;
use ab_glyph::{Font, FontRef};
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeMap;
use std::io::Write;
use subsetter::GlyphRemapper;

/// Name of the font in the file. The six letters mark a part of a font.
const NAME: Name<'static> = Name(b"CITTER+DejaVuSans");
/// Kind of the glyph numbers.
const INFO: SystemInfo<'static> = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

/// A glyph of the cut font.
struct Glyph {
    number: u16,
    /// Width in thousandths of an em.
    width: f32,
}

/// The glyphs that were asked for so far.
pub(super) struct PdfFont {
    font: FontRef<'static>,
    per_em: f32,
    remapper: GlyphRemapper,
    glyphs: BTreeMap<char, Glyph>,
}

/// The objects of the font in a file.
pub(super) struct FontRefs {
    pub(super) font: Ref,
    pub(super) cid: Ref,
    pub(super) descriptor: Ref,
    pub(super) data: Ref,
    pub(super) unicode: Ref,
}

impl PdfFont {
    /// # Errors
    /// A damaged font.
    pub(super) fn new() -> Result<Self> {
        let font = FontRef::try_from_slice(FONT_BYTES).map_err(plot_error)?;
        let per_em = font.units_per_em().unwrap_or(2048.0);
        Ok(Self { font, per_em, remapper: GlyphRemapper::new(), glyphs: BTreeMap::new() })
    }

    fn glyph(&mut self, c: char) -> &Glyph {
        let (font, per_em, remapper) = (&self.font, self.per_em, &mut self.remapper);
        self.glyphs.entry(c).or_insert_with(|| {
            let id = font.glyph_id(c);
            Glyph { number: remapper.remap(id.0), width: 1000.0 * font.h_advance_unscaled(id) / per_em }
        })
    }

    /// The bytes that show a text, and its width at a size of 1.
    pub(super) fn encode(&mut self, text: &str) -> (Vec<u8>, f32) {
        let (mut bytes, mut width) = (Vec::new(), 0.0);
        for c in text.chars() {
            let glyph = self.glyph(c);
            bytes.extend(glyph.number.to_be_bytes());
            width += glyph.width / 1000.0;
        }
        (bytes, width)
    }

    /// Write the font and the map from its glyphs to characters, by which a reader finds and copies text.
    ///
    /// # Errors
    /// A font that cannot be cut.
    pub(super) fn write(&self, pdf: &mut Pdf, refs: &FontRefs) -> Result<()> {
        let cut = subsetter::subset(FONT_BYTES, 0, &self.remapper).map_err(plot_error)?;
        pdf.type0_font(refs.font)
            .base_font(NAME)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(refs.cid)
            .to_unicode(refs.unicode);
        let mut cid = pdf.cid_font(refs.cid);
        cid.subtype(CidFontType::Type2).base_font(NAME).system_info(INFO).font_descriptor(refs.descriptor).default_width(0.0);
        cid.cid_to_gid_map_predefined(Name(b"Identity"));
        let mut widths = cid.widths();
        for glyph in self.glyphs.values() {
            widths.consecutive(glyph.number, [glyph.width]);
        }
        widths.finish();
        cid.finish();
        let scale = |v: f32| 1000.0 * v / self.per_em;
        let (ascent, descent) = (scale(self.font.ascent_unscaled()), scale(self.font.descent_unscaled()));
        pdf.font_descriptor(refs.descriptor)
            .name(NAME)
            .flags(FontFlags::SYMBOLIC)
            .bbox(Rect::new(-1021.0, -463.0, 1794.0, 1233.0))
            .italic_angle(0.0)
            .ascent(ascent)
            .descent(descent)
            .cap_height(729.0)
            .stem_v(80.0)
            .font_file2(refs.data);
        pdf.stream(refs.data, &packed(&cut)?).filter(Filter::FlateDecode).pair(Name(b"Length1"), cut.len() as i32);
        let mut unicode: UnicodeCmap = UnicodeCmap::new(Name(b"Custom"), INFO);
        for (c, glyph) in &self.glyphs {
            unicode.pair(glyph.number, *c);
        }
        pdf.cmap(refs.unicode, &unicode.finish());
        Ok(())
    }
}

/// Bytes packed by zlib.
///
/// # Errors
/// Never; the packer's error is passed on.
pub(super) fn packed(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(bytes).map_err(plot_error)?;
    packer.finish().map_err(plot_error)
}
