//! The committed figures' legends: a colour is that of its space and variant, and of nothing else.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::{SPACES, of_label};

/// Colour and label of every entry, from the file: a dot or a dash and the text right after it, behind all panels. A forest plot has
/// neither panels nor a legend.
fn legend(svg: &str) -> Vec<(String, String)> {
    let Some(end_of_panels) = svg.rfind("</g>") else { return vec![] };
    let parts: Vec<&str> = svg[end_of_panels..].split('<').filter(|part| !part.starts_with('/')).collect();
    let entry = |pair: &[&str]| {
        let value =
            |name: &str| pair[0].split_once(&format!(" {name}=\"")).and_then(|(_, rest)| rest.split('"').next());
        let swatch = pair[0].starts_with("circle").then(|| value("fill"));
        let swatch = swatch.or_else(|| pair[0].starts_with("line").then(|| value("stroke")))?;
        let (_, label) = pair[1].starts_with("text").then(|| pair[1].split_once('>'))??;
        Some((swatch?.to_owned(), label.to_owned()))
    };
    parts.windows(2).filter_map(entry).collect()
}

fn figures(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs_err::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            figures(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "svg") {
            found.push(path);
        }
    }
}

#[test]
fn a_colour_belongs_to_a_space_and_its_variant_in_every_committed_figure() {
    let mut paths = vec![];
    figures(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results"), &mut paths);
    let mut known = BTreeSet::new();
    for path in &paths {
        let legend = legend(&fs_err::read_to_string(path).unwrap());
        let file = path.display();
        for (at, (color, label)) in legend.iter().enumerate() {
            if let Some((_, other)) = legend[..at].iter().find(|(earlier, _)| earlier == color) {
                panic!("{file}: {other} and {label} are both {color}");
            }
            match of_label(label) {
                Some(own) => {
                    assert_eq!(*color, own, "{file}: {label}");
                    known.insert(label.clone());
                }
                None => assert!(SPACES.iter().all(|(_, own)| own != color), "{file}: {label} has a space's {color}"),
            }
            // Figures of runs show spaces and nothing else.
            let name = path.file_name().unwrap().to_string_lossy();
            assert!(!name.starts_with("curves_") || known.contains(label), "{file}: {label} has no colour of its own");
        }
    }
    // Legends were found; without them nothing would have been checked.
    assert!(paths.len() > 20 && known.len() > 20, "{} figures, spaces and variants {known:?}", paths.len());
}
