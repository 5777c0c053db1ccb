//! Checks names that users choose. A name becomes a part of a folder's name, a cell of a table and an argument of a command.

/// The longest name (characters): three of them fit into the 255 bytes of a folder's name.
pub const LONGEST: usize = 80;

/// Checks a name.
///
/// Commands read a name that begins with `-` as an option, and spreadsheets read one that begins with `=` or `+` as a formula. A leading
/// dot would hide the folder. Programs that read tables would round a name that is a number; [`check_part`] allows a number, as one part of
/// a longer name.
///
/// # Errors
/// What is wrong with the name, and what would be right.
///
/// ```
/// assert!(aforce::name::check("low-2.5").is_ok());
/// assert_eq!(aforce::name::check("-x").unwrap_err(), "\"-x\" is no name: letters, digits and - _ = + . are allowed, a letter or digit first");
/// ```
pub fn check(name: &str) -> Result<(), String> {
    check_part(name)?;
    if name.parse::<f64>().is_ok() {
        return Err(format!("{name:?} reads as a number, which tables would round"));
    }
    Ok(())
}

/// Checks a part of a name. It follows the rules of [`check`], but may be a number.
///
/// # Errors
/// As [`check`].
pub fn check_part(name: &str) -> Result<(), String> {
    if name.len() > LONGEST {
        let start: String = name.chars().take(16).collect();
        return Err(format!("\"{start}...\" is too long: a name has at most {LONGEST} characters"));
    }
    if !name.starts_with(|c: char| c.is_ascii_alphanumeric()) || !name.chars().all(may_have) {
        return Err(format!("{name:?} is no name: letters, digits and - _ = + . are allowed, a letter or digit first"));
    }
    Ok(())
}

/// Whether a name may have this character.
#[must_use]
pub fn may_have(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_=+.".contains(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_tables_folders_and_commands_would_read_otherwise_is_no_name() {
        for name in ["aforce", "7-joints", "k=3", &"n".repeat(LONGEST)] {
            check(name).unwrap();
        }
        check_part("3").unwrap();
        for (name, reason) in [
            ("=1+1", "a letter or digit first"),
            ("-x", "a letter or digit first"),
            ("+x", "a letter or digit first"),
            (".hidden", "a letter or digit first"),
            ("", "is no name"),
            ("a/b", "are allowed"),
            ("a b", "are allowed"),
            ("1e3", "reads as a number"),
            ("nan", "reads as a number"),
            (&"n".repeat(LONGEST + 1), "at most 80 characters"),
        ] {
            let told = check(name).unwrap_err();
            assert!(told.contains(reason), "{told}");
        }
    }
}
