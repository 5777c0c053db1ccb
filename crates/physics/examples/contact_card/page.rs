//! The card as a table and as a page, whose numbers are cells of the table.

use std::fmt::Write;

use crate::cases::Figure;

/// A measured number beside MuJoCo's.
pub struct Row {
    figure: Figure,
    /// With MuJoCo's default contacts, and with stiff ones.
    mujoco: [String; 2],
}

impl Row {
    /// Looks MuJoCo's numbers up in the text of the reference.
    pub fn new(figure: Figure, reference: &str) -> Self {
        let cells =
            reference.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(';').collect::<Vec<_>>());
        let known = cells.into_iter().find(|cells| cells[0] == figure.case && cells[1] == figure.quantity);
        let [.., soft, stiff] =
            known.unwrap_or_else(|| panic!("{}, {}: not in the reference", figure.case, figure.quantity))[..]
        else {
            panic!("a row of the reference is too short");
        };
        Row { figure, mujoco: [soft, stiff].map(String::from) }
    }

    fn cells(&self) -> [String; 7] {
        let Figure { case, quantity, unit, expected, rapier } = &self.figure;
        let expected = expected.map_or(String::new(), digits);
        let [soft, stiff] = self.mujoco.clone();
        [case.clone(), quantity.to_string(), unit.to_string(), expected, digits(*rapier), soft, stiff]
    }
}

/// Four significant digits; what is less than 1e-4 of the unit is zero.
fn digits(value: f64) -> String {
    if value.abs() < 1e-4 {
        return "0".into();
    }
    let decimals = (3 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

pub fn csv(rows: &[Row]) -> String {
    let mut out = String::from("case,quantity,unit,expected,rapier,mujoco,mujoco_stiff\n");
    for row in rows {
        let quoted = row.cells().map(|cell| if cell.contains(',') { format!("\"{cell}\"") } else { cell });
        writeln!(out, "{}", quoted.join(",")).expect("memory");
    }
    out
}

const HEAD: &str = "\
# Contact card

Rapier, this workbench's engine, keeps to geometry: bodies hardly overlap, and a peg enters where it should. A cube slips at the friction that should just hold it.

The same scenes in Rapier 0.36.1 (steps of 2 ms, this project's settings) and MuJoCo 3.17.0 (default contacts, and stiff ones with `solref`
0.004; elliptic cone, `impratio` 20). *Expected* is Coulomb's law or geometry.

";

const FOOT: &str = "
- **Held cube:** pads press with 2 N each. Friction is a multiple of what just holds it. At 1.00 it only balances the weight, so the speed gained in the first step stays.
- **Driven into itself:** springs of 200 Nm/rad pull the arm into overlapping postures; the force is the mean over the last of 4 s.
- **Peg:** square, 7.986 mm wide, 25 mm deep, friction 0.75, on springs of 500 N/m, lowered at 20 mm/s. It should enter at offsets below
  half the clearance.
- **Door:** 5 Nm open it, the handle at rest or turned by 3 Nm.

All numbers: [contact.csv](contact.csv). `cargo run --release -p physics --example contact_card -- results/contact` makes both; MuJoCo's half
comes from `scripts/mujoco_contact_card.py`.
";

pub fn markdown(rows: &[Row]) -> String {
    let mut out = String::from(HEAD);
    out += "| case | quantity | unit | expected | Rapier | MuJoCo | stiff |\n|---|---|---|---|---|---|---|\n";
    for row in rows.iter().filter(|row| !row.figure.case.starts_with("held") || row.figure.unit == "mm") {
        writeln!(out, "| {} |", row.cells().join(" | ")).expect("memory");
    }
    out + FOOT
}
