//! Seeds of a run's streams of random numbers, each by its name, so that a new stream does not change the others.

/// Sub-seed of `stream` in the run with `seed`; `index` counts within the stream.
pub fn sub_seed(seed: u64, stream: &str, index: u64) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&seed.to_le_bytes()).update(stream.as_bytes()).update(&index.to_le_bytes());
    let bytes: [u8; 8] = hasher.finalize().as_bytes()[..8].try_into().expect("eight bytes");
    u64::from_le_bytes(bytes)
}

/// Seed of the `index`-th episode of the `evaluation`-th evaluation in training. All runs and action spaces have the same
/// starts, so that differences are paired. Each evaluation has others, so that a mean over evaluations is a mean over
/// starts.
pub fn training_evaluation_seed(evaluation: u64, index: u32) -> u64 {
    sub_seed(evaluation, "evaluation while learning", u64::from(index))
}

/// Seed of the `index`-th evaluation episode of programs that do not train. All policies and action spaces have the same
/// starts, and no checkpoint was chosen by them.
pub fn evaluation_seed(index: u32) -> u64 {
    sub_seed(0, "evaluation", u64::from(index))
}

/// The seed that a table writes in its column `episode_seed`: hexadecimal after 0x, or decimal as older tables have it.
///
/// # Errors
/// If the text is neither, in words.
pub fn episode_seed(text: &str) -> Result<u64, String> {
    let number = text.strip_prefix("0x").map_or_else(|| text.parse(), |digits| u64::from_str_radix(digits, 16));
    number.map_err(|_| {
        "neither 0x and up to 16 hexadecimal digits nor a number of 64 bits, as the column episode_seed has them".into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_read_as_tables_have_them() {
        assert_eq!((episode_seed("0xff"), episode_seed("18446744073709551615")), (Ok(255), Ok(u64::MAX)));
        for wrong in ["", "0x", "ff", "-3", "2.5e18", "0x10000000000000000"] {
            assert!(episode_seed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn streams_differ_and_repeat() {
        assert_eq!(sub_seed(1, "a", 0), sub_seed(1, "a", 0));
        let all = [sub_seed(1, "a", 0), sub_seed(1, "a", 1), sub_seed(1, "b", 0), sub_seed(2, "a", 0)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a != b));
        }
    }
}
