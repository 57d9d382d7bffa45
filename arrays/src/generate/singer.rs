//! Perfect difference sets: q + 1 numbers below v = q^2 + q + 1 whose differences give each number from 1 to v - 1 once, modulo v.
//!
//! The numbers i for which the trace of the power a^i vanishes, for a primitive element a of the field of q^3 elements over that of q
//! elements, are the points of a line of the projective plane of order q. There is such a set for each power q of a prime.
//!
//! # Reference
//! Singer 1938, Trans. Amer. Math. Soc. 43, 377.

/// The prime of which `q` is a power, and the power.
fn prime_power(q: usize) -> Option<(usize, u32)> {
    if q < 2 {
        return None;
    }
    let p = (2..).take_while(|p| p * p <= q).find(|p| q.is_multiple_of(*p)).unwrap_or(q);
    let mut power = 0;
    let mut rest = q;
    while rest.is_multiple_of(p) && rest > 1 {
        rest /= p;
        power += 1;
    }
    (rest == 1 && power > 0).then_some((p, power))
}

/// True where there is a set of so many numbers.
pub fn has_set(size: usize) -> bool {
    size >= 3 && prime_power(size - 1).is_some()
}

/// The modulus v of the set of so many numbers.
pub fn modulus(size: usize) -> usize {
    size * (size - 1) + 1
}

/// The perfect difference set of `size` numbers in rising order, moved so that it starts with 0 before its widest gap closes the circle;
/// `None` unless `size` - 1 is a power of a prime.
pub fn difference_set(size: usize) -> Option<Vec<usize>> {
    let (p, power) = prime_power(size.checked_sub(1)?).filter(|_| size >= 3)?;
    let v = modulus(size);
    let field = Field::new(p, 3 * power as usize);
    let traces = field.traces(size - 1);
    let mut element = field.one();
    let mut set = Vec::with_capacity(size);
    for i in 0..v {
        let zero = (0..field.degree).all(|k| element.iter().zip(&traces).map(|(c, t)| c * t[k]).sum::<usize>() % p == 0);
        if zero {
            set.push(i);
        }
        field.step(&mut element);
    }
    let gap = |k: usize| if k == 0 { set[0] + v - set[size - 1] } else { set[k] - set[k - 1] };
    let first = (0..size).max_by_key(|k| (gap(*k), size - k))?;
    let mut moved: Vec<usize> = set.iter().map(|m| (m + v - set[first]) % v).collect();
    moved.sort_unstable();
    Some(moved)
}

/// The field of p^degree elements: polynomials in x over the numbers modulo p, modulo a polynomial for which x is a primitive element.
struct Field {
    p: usize,
    degree: usize,
    /// x^degree as a polynomial of lower degree.
    top: Vec<usize>,
}

impl Field {
    fn new(p: usize, degree: usize) -> Self {
        let order = p.pow(degree as u32) - 1;
        let mut rest = order;
        let mut factors = Vec::new();
        let mut f = 2;
        while f * f <= rest {
            if rest.is_multiple_of(f) {
                factors.push(f);
                while rest.is_multiple_of(f) {
                    rest /= f;
                }
            }
            f += 1;
        }
        if rest > 1 {
            factors.push(rest);
        }
        // One in about `degree` polynomials is primitive, so the search in the order of their coefficients is short.
        let mut number = p;
        loop {
            let mut digits = number;
            let top = (0..degree).map(|_| {
                let digit = digits % p;
                digits /= p;
                digit
            });
            let field = Self { p, degree, top: top.collect() };
            // x has this order only if all powers of x are different, and then every element but 0 is a power of x.
            if field.power(order) == field.one() && factors.iter().all(|f| field.power(order / f) != field.one()) {
                return field;
            }
            number += 1;
        }
    }

    fn one(&self) -> Vec<usize> {
        (0..self.degree).map(|k| usize::from(k == 0)).collect()
    }

    /// Multiply by x.
    fn step(&self, a: &mut [usize]) {
        let carry = a[self.degree - 1];
        a.rotate_right(1);
        a[0] = 0;
        a.iter_mut().zip(&self.top).for_each(|(a, t)| *a = (*a + carry * t) % self.p);
    }

    fn product(&self, a: &[usize], b: &[usize]) -> Vec<usize> {
        let mut out = vec![0; self.degree];
        let mut shifted = a.to_vec();
        for digit in b {
            out.iter_mut().zip(&shifted).for_each(|(o, s)| *o = (*o + digit * s) % self.p);
            self.step(&mut shifted);
        }
        out
    }

    /// x to a power.
    fn power(&self, n: usize) -> Vec<usize> {
        let mut x = self.one();
        self.step(&mut x);
        self.raised(&x, n)
    }

    fn raised(&self, base: &[usize], mut n: usize) -> Vec<usize> {
        let (mut out, mut base) = (self.one(), base.to_vec());
        while n > 0 {
            if n & 1 == 1 {
                out = self.product(&out, &base);
            }
            base = self.product(&base, &base);
            n >>= 1;
        }
        out
    }

    /// The traces t + t^q + t^(q^2) of the powers t = x^k, k below the degree. The trace is linear over the numbers modulo p.
    fn traces(&self, q: usize) -> Vec<Vec<usize>> {
        let mut t = self.one();
        (0..self.degree)
            .map(|_| {
                let (first, second) = (self.raised(&t, q), self.raised(&t, q * q));
                let trace = (0..self.degree).map(|k| (t[k] + first[k] + second[k]) % self.p).collect();
                self.step(&mut t);
                trace
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_difference_comes_once() {
        for size in [3, 4, 5, 6, 8, 9, 10, 12, 14, 17, 18, 20, 24, 26, 28, 30, 32, 33, 50, 65, 98] {
            let (set, v) = (difference_set(size).unwrap(), modulus(size));
            assert_eq!((set.len(), set[0]), (size, 0));
            let mut seen = vec![0; v];
            for a in &set {
                for b in set.iter().filter(|b| *b != a) {
                    seen[(a + v - b) % v] += 1;
                }
            }
            assert!(seen[0] == 0 && seen[1..].iter().all(|n| *n == 1), "{size}");
        }
    }

    #[test]
    fn sets_exist_for_powers_of_primes_only() {
        let sizes: Vec<usize> = (0..30).filter(|n| has_set(*n)).collect();
        assert_eq!(sizes, [3, 4, 5, 6, 8, 9, 10, 12, 14, 17, 18, 20, 24, 26, 28]);
        assert!(difference_set(7).is_none() && difference_set(0).is_none() && difference_set(2).is_none());
    }
}
