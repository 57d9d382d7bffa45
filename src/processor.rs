//! Loops that are compiled for the processors that a program may run on.

/// A function with the loops of another one, compiled for any machine, for AVX2 and for AVX-512. Multiplication and addition are rounded one by one, so
/// all give the same bytes. The other function must be `#[inline(always)]`.
macro_rules! for_this_processor {
    ($(#[$doc:meta])+ $name:ident, $loops:ident($($arg:ident: $type:ty),+) $(-> $out:ty)?) => {
        $(#[$doc])+
        pub(super) fn $name($($arg: $type),+) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512vl,avx2")]
                fn widest($($arg: $type),+) $(-> $out)? {
                    $loops($($arg),+)
                }
                #[target_feature(enable = "avx2")]
                fn wide($($arg: $type),+) $(-> $out)? {
                    $loops($($arg),+)
                }
                if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
                    // SAFETY: the machine has just been found to have AVX-512, and with it AVX2.
                    return unsafe { widest($($arg),+) };
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the machine has just been found to have AVX2.
                    return unsafe { wide($($arg),+) };
                }
            }
            $loops($($arg),+)
        }
    };
}

pub(crate) use for_this_processor;
