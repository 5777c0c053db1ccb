//! Loops that are compiled twice: for AVX2, used where the processor has it, and for every x86-64 processor.
//!
//! Both give the same bits. The compiler may do eight additions at once, but neither reorders the sum of a loop nor fuses a product
//! with an addition, unless it is told to.

/// Functions whose bodies are compiled for AVX2 as well.
macro_rules! wide {
    ($($(#[$about:meta])* $visibility:vis fn $name:ident($($argument:ident: $type:ty),* $(,)?) $body:block)*) => {$(
        $(#[$about])*
        $visibility fn $name($($argument: $type),*) {
            #[inline(always)]
            fn anywhere($($argument: $type),*) $body

            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) {
                    anywhere($($argument),*);
                }
                if $crate::simd::has_avx2() {
                    // SAFETY: the processor has AVX2.
                    return unsafe { avx2($($argument),*) };
                }
            }
            anywhere($($argument),*)
        }
    )*};
}
pub(crate) use wide;

#[cfg(target_arch = "x86_64")]
pub(crate) fn has_avx2() -> bool {
    #[cfg(test)]
    if WITHOUT_AVX2.get() {
        return false;
    }
    is_x86_feature_detected!("avx2")
}

#[cfg(test)]
thread_local! {
    static WITHOUT_AVX2: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// What `f` returns on a processor with AVX2 and on one without.
#[cfg(test)]
pub(crate) fn with_and_without_avx2<T>(f: impl Fn() -> T) -> [T; 2] {
    [false, true].map(|without| {
        WITHOUT_AVX2.set(without);
        let result = f();
        WITHOUT_AVX2.set(false);
        result
    })
}
