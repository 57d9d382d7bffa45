//! The compression of GIF: runs of bytes that were seen before become codes of 9 to 12 bits.
//!
//! # Reference
//! Welch 1984, IEEE Computer 17(6), 8; CompuServe 1990, GIF89a, appendix F.

/// Bits of a level.
pub(super) const LEVEL_BITS: u8 = 8;
/// The code that empties the table.
const CLEAR: u16 = 1 << LEVEL_BITS;
/// The code after the last byte.
const END: u16 = CLEAR + 1;
/// Number of codes of 12 bits, the widest.
const CODES: u16 = 1 << 12;
/// Places of the table. A power of two above the number of codes.
const PLACES: usize = 1 << 13;
/// An empty place.
const FREE: u32 = u32::MAX;

/// The known runs: a run is the code of a shorter one and a byte.
struct Table {
    /// Code of the shorter run times 256, plus the byte.
    keys: Vec<u32>,
    codes: Vec<u16>,
    next: u16,
}

impl Table {
    fn new() -> Self {
        Self { keys: vec![FREE; PLACES], codes: vec![0; PLACES], next: END + 1 }
    }

    /// The place of a run, or the free place where it belongs.
    fn place(&self, key: u32) -> usize {
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 19) as usize;
        while self.keys[at] != FREE && self.keys[at] != key {
            at = (at + 1) % PLACES;
        }
        at
    }

    fn clear(&mut self) {
        self.keys.fill(FREE);
        self.next = END + 1;
    }
}

/// Codes as bits, the lowest bit of each code first.
struct Bits {
    out: Vec<u8>,
    waiting: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, code: u16, width: u32) {
        self.waiting |= u32::from(code) << self.count;
        self.count += width;
        while self.count >= 8 {
            self.out.push(self.waiting as u8);
            self.waiting >>= 8;
            self.count -= 8;
        }
    }
}

/// Bytes as the codes of GIF.
pub(super) fn compress(bytes: &[u8]) -> Vec<u8> {
    let mut table = Table::new();
    let mut bits = Bits { out: Vec::with_capacity(bytes.len() / 2), waiting: 0, count: 0 };
    let mut width = u32::from(LEVEL_BITS) + 1;
    bits.put(CLEAR, width);
    let mut rest = bytes.iter();
    let Some(first) = rest.next() else {
        bits.put(END, width);
        bits.put(0, 7);
        return bits.out;
    };
    let mut run = u16::from(*first);
    for byte in rest {
        let key = u32::from(run) << 8 | u32::from(*byte);
        let at = table.place(key);
        if table.keys[at] == key {
            run = table.codes[at];
            continue;
        }
        bits.put(run, width);
        run = u16::from(*byte);
        if table.next == CODES {
            bits.put(CLEAR, width);
            table.clear();
            width = u32::from(LEVEL_BITS) + 1;
            continue;
        }
        // The reader learns each run one code later, so a code is wider from the code after its power of two.
        if table.next == 1 << width {
            width += 1;
        }
        (table.keys[at], table.codes[at]) = (key, table.next);
        table.next += 1;
    }
    bits.put(run, width);
    if table.next == 1 << width && table.next < CODES {
        width += 1;
    }
    bits.put(END, width);
    bits.put(0, 7);
    bits.out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reader that follows the text of the specification.
    fn expand(data: &[u8]) -> Vec<u8> {
        let mut at = 0;
        let mut read = |width: u32| {
            let bit = |k: usize| u16::from(data[k / 8] >> (k % 8) & 1);
            let code = (0..width as usize).map(|k| bit(at + k) << k).sum::<u16>();
            at += width as usize;
            code
        };
        let mut out = Vec::new();
        let mut table: Vec<Vec<u8>> = Vec::new();
        let fresh = || (0..=END).map(|k| if k < CLEAR { vec![k as u8] } else { Vec::new() }).collect::<Vec<_>>();
        let (mut width, mut last): (u32, Option<Vec<u8>>) = (9, None);
        loop {
            let code = read(width);
            if code == CLEAR {
                (table, width, last) = (fresh(), 9, None);
                continue;
            }
            if code == END {
                return out;
            }
            let run = match (table.get(usize::from(code)), &last) {
                (Some(run), _) => run.clone(),
                (None, Some(last)) => last.iter().chain(&last[..1]).copied().collect(),
                (None, None) => panic!("code {code} before it is known"),
            };
            if let Some(mut longer) = last.take().filter(|_| table.len() < 4096) {
                longer.push(run[0]);
                table.push(longer);
            }
            out.extend_from_slice(&run);
            last = Some(run);
            if table.len() == 1 << width && width < 12 {
                width += 1;
            }
        }
    }

    fn noise(n: usize, levels: u64) -> Vec<u8> {
        let mut x = 1_u64;
        (0..n)
            .map(|_| {
                x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((x >> 33) % levels) as u8
            })
            .collect()
    }

    #[test]
    fn a_reader_of_the_specification_gets_the_bytes_back() {
        for n in [0, 1, 2, 3, 255, 256, 257, 5000] {
            assert_eq!(expand(&compress(&vec![7; n])), vec![7; n], "{n} equal bytes");
        }
        // Every length around which a code becomes wider or the table is full.
        for levels in [2, 3, 16, 256] {
            let bytes = noise(60_000, levels);
            for n in (1..4600).chain([20_000, 60_000]) {
                let n = if levels == 256 { n } else { n * 13 % 60_000 + 1 };
                if n % 7 == 0 || (250..262).contains(&n) || (500..520).contains(&n) || (3_830..3_850).contains(&n) || n > 4_000 {
                    assert!(expand(&compress(&bytes[..n])) == bytes[..n], "{n} bytes of {levels} levels");
                }
            }
        }
    }

    #[test]
    fn even_pictures_become_small() {
        assert!(compress(&vec![9; 100_000]).len() < 1000);
    }
}
