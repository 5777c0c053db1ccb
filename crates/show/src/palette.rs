//! Colours. An action space and its variant have the same colour in every figure and page, and nothing else in a figure
//! has it.
//!
//! A label is `SPACE`, `SPACE,VARIANT` or one of these with `, NAME preset` after it, or any other words. A space that is listed here has a
//! colour of its own. A variant has a shade of its space's colour; a hash of its name chooses which. Any other label has one of eight
//! colours that no listed space has, also chosen by a hash of its name. Where two labels of a figure choose the same colour, the later one
//! gets the next.

/// Colours of the built-in spaces, and of those of the committed runs. Many are Okabe and Ito's, which colour-blind
/// readers can tell apart. A space with force has a colour like that of the same space without.
const SPACES: [(&str, &str); 42] = [
    ("aforce", "#0072b2"),
    ("aforce-force", "#56b4e9"),
    ("variable", "#d55e00"),
    ("variable-force", "#e69f00"),
    ("osc", "#009e73"),
    ("osc-force", "#66c2a5"),
    ("low", "#cc79a7"),
    ("low-force", "#aa4499"),
    ("mid", "#b07aa1"),
    ("mid-force", "#8c6d8c"),
    ("high", "#8b4513"),
    ("high-force", "#c49c6b"),
    ("aforce-psi", "#332288"),
    ("aforce-psi-force", "#6a5acd"),
    ("aforce-shaped", "#4477aa"),
    ("aforce-shaped-force", "#88aacc"),
    ("robosuite-variable", "#aa3322"),
    ("robosuite-osc", "#117733"),
    ("aforce-1s2", "#003f7f"),
    ("aforce-1s2-force", "#1f3fd0"),
    ("aforce-1s2-soft-wrist", "#0fb5c4"),
    ("floor", "#101010"),
    ("floor-force", "#4a4a4a"),
    ("floor-ff", "#928b84"),
    ("floor-ff-force", "#a3adb5"),
    ("floor-900-force", "#556b2f"),
    ("no-ff", "#8a2be2"),
    ("no-ff-force", "#b87ff0"),
    ("mean", "#808000"),
    ("stiff", "#d81b60"),
    ("sign-printed", "#c71585"),
    ("sign-printed-force", "#ff69b4"),
    ("aforce-scaled", "#2e5d7d"),
    ("aforce-scaled-force", "#17a2b8"),
    ("fixed-565", "#9acd32"),
    ("fixed-100", "#d4c400"),
    ("aforce-idle", "#6a9fc8"),
    ("variable-shared", "#b8860b"),
    ("osc-idle", "#3c9f6b"),
    ("draw-38", "#e07b39"),
    ("draw-61", "#5b8c00"),
    ("printed-draw-38", "#d6336c"),
];

/// Colours for labels that are not in [`SPACES`]: far from the colours there, and from each other.
const OTHERS: [&str; 8] = ["#00b400", "#dd22ee", "#770055", "#3388ff", "#ff8080", "#005500", "#e00000", "#0000bb"];

/// Shades of a colour: the grey with which it is mixed (0 is black, 255 white), and the share of the grey.
const SHADES: [(u8, f64); 8] =
    [(0, 0.2), (255, 0.2), (0, 0.35), (255, 0.35), (0, 0.5), (255, 0.5), (128, 0.45), (128, 0.7)];

/// The colour of an action space by its name, upper or lower case; `None` for one without a colour of its own.
pub fn of_space(name: &str) -> Option<&'static str> {
    SPACES.iter().find(|(space, _)| space.eq_ignore_ascii_case(name)).map(|(_, color)| *color)
}

/// The colour that the variant of a known space has in every figure; `None` for other labels. Only where two
/// variants of a space in one figure choose the same shade, [`colors`] gives the later one the next.
pub fn of_label(label: &str) -> Option<String> {
    let (space, variant) = parts(label);
    of_space(space).map(|color| if variant.is_empty() { color.into() } else { shades(color, variant).remove(0) })
}

/// The colours of all labels of a figure, each `#rrggbb`. No two are the same if no space has more than eight variants: labels that are
/// no known space get eight colours, then the shades of these.
pub fn colors(labels: &[&str]) -> Vec<String> {
    let mut spaces: Vec<(&str, String)> = vec![];
    for (space, _) in labels.iter().map(|label| parts(label)) {
        if spaces.iter().all(|(known, _)| *known != space) {
            let color = of_space(space).map_or_else(|| unused(&others(space), &spaces), String::from);
            spaces.push((space, color));
        }
    }
    let mut colors: Vec<(&str, String)> = vec![];
    for label in labels {
        let (space, variant) = parts(label);
        let (_, color) = spaces.iter().find(|(known, _)| *known == space).expect("every label has a space");
        let color = if variant.is_empty() { color.clone() } else { unused(&shades(color, variant), &colors) };
        colors.push((label, color));
    }
    colors.into_iter().map(|(_, color)| color).collect()
}

/// A colour `#rrggbb` with a share of a grey in it, of which 0 is black and 255 white.
fn mixed(color: &str, grey: u8, share: f64) -> String {
    let channel = |at: usize| {
        let value = f64::from(u8::from_str_radix(&color[at..at + 2], 16).expect("a colour of the palette"));
        (value + share * (f64::from(grey) - value)).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", channel(1), channel(3), channel(5))
}

/// The space and the variant of a label; a preset's name is a part of the variant. A label of other words counts as a
/// space without a variant.
fn parts(label: &str) -> (&str, &str) {
    match label.split_once(',') {
        Some((space, variant)) if !variant.starts_with(' ') || variant.ends_with(" preset") => (space, variant),
        _ => (label, ""),
    }
}

/// The colours that a label without one of its own may have, in the order in which they are tried.
fn others(name: &str) -> Vec<String> {
    let plain = chosen(&OTHERS, name).map(|color| color.to_string());
    plain.chain(chosen(&OTHERS, name).flat_map(|color| shades(color, name))).collect()
}

/// The shades of `color` that a variant may have, in the order in which they are tried.
fn shades(color: &str, variant: &str) -> Vec<String> {
    chosen(&SHADES, variant).map(|&(grey, share)| mixed(color, grey, share)).collect()
}

/// All items in their order, beginning with the one that the name's hash chooses; after the last comes the first.
fn chosen<'a, T>(items: &'a [T; 8], name: &str) -> impl Iterator<Item = &'a T> {
    // FNV-1a. Its last three bits differ between names that end in different digits below 8.
    let hash = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    items.iter().cycle().skip((hash % 8) as usize).take(items.len())
}

/// The first of `wanted` that is not taken, or else the first.
fn unused(wanted: &[String], taken: &[(&str, String)]) -> String {
    let free = |color: &&String| taken.iter().all(|(_, other)| other != *color);
    wanted.iter().find(free).unwrap_or(&wanted[0]).clone()
}

#[cfg(test)]
mod legends;
#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::iter;

    #[test]
    fn no_colour_and_no_shade_is_that_of_another() {
        let plain: Vec<&str> = SPACES.iter().map(|(_, color)| *color).chain(OTHERS).collect();
        let all = plain.iter().flat_map(|color| iter::once(color.to_string()).chain(shades(color, "")));
        let all: Vec<String> = all.collect();
        assert_eq!(all.len(), 9 * plain.len());
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
    }

    #[test]
    fn a_space_and_its_variant_keep_their_colours_whatever_else_is_drawn() {
        let labels = ["mine", "variable", "AFORCE", "aforce,draw-1", "aforce,draw-3", "aforce, paper preset"];
        let colors = colors(&labels);
        for (label, color) in labels.iter().zip(&colors).skip(1) {
            assert_eq!(of_label(label).as_ref(), Some(color), "{label}");
        }
        assert_eq!((of_space("AFORCE"), of_space("mine"), of_label("mine,soft")), (Some("#0072b2"), None, None));
        assert_eq!(super::colors(&["osc", "mine"])[1], colors[0], "somebody's own has the same in every figure too");
    }

    #[test]
    fn labels_of_one_figure_never_share_a_colour() {
        let names = (0..10).map(|k| format!("mine-{k}"));
        let variants = (0..6).flat_map(|k| ["aforce", "mine-1"].map(|space| format!("{space},v{}", 10 * k)));
        let words = ["x", "y", "hand, mean", "hand, largest"].map(String::from);
        let labels: Vec<String> = names.chain(variants).chain(words).collect();
        let colors = colors(&labels.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(colors.iter().collect::<BTreeSet<_>>().len(), labels.len());
        let known: Vec<&str> = SPACES.map(|(_, color)| color).into();
        assert!(colors.iter().all(|color| !known.contains(&color.as_str())), "that of a known space is nobody else's");
    }
}
