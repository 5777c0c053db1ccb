//! A sweep over settings, from its file to the tables of its report.

mod common;

use common::{few, note, program, states};
use experiments::run::csv_table::CsvTable;

#[test]
fn settings_are_swept_like_spaces() {
    let folder = tempfile::tempdir().unwrap();
    let (base, file) = (folder.path().join("few.toml"), folder.path().join("varied.toml"));
    std::fs::write(&base, few(300)).unwrap();
    let group =
        |vary: &str| format!("[[group]]\ntasks = [\"lift\"]\nspaces = [\"aforce\", \"osc\"]\nseeds = [1]\n{vary}\n");
    let text = "name = \"settings\"\nextends = \"few.toml\"\n".to_string()
        + &group("")
        + &group("vary = { \"learner.n_step\" = [1], \"env.horizon\" = [50] }");
    std::fs::write(&file, text).unwrap();

    let out = folder.path().join("runs/settings");
    program("sweep").current_dir(folder.path()).arg("varied.toml").assert().success();
    assert_eq!(states(&file, &out), ["done"; 4]);
    let run = out.join("lift/osc,n_step=1,horizon=50/seed_1");
    assert_eq!(note(&run.join("checkpoints/best")).unwrap()["variant"], "n_step=1,horizon=50");
    // As its config.toml says, it is the same run.
    let mut again = program("train");
    again.arg("--config").arg(run.join("config.toml")).arg("--resume").arg("--out").arg(&out).arg("--quiet");
    again.assert().success();
    let mut evaluate = program("evaluate");
    evaluate.args(["--episodes", "1", "--run"]).arg(&run).assert().success();

    program("report").arg(&out).assert().success();
    let table = |name: &str| CsvTable::read(&out.join(name)).unwrap();
    let varied = "n_step=1,horizon=50";
    assert_eq!(table("runs.csv").column("variant").unwrap(), ["", varied, "", varied]);
    let compared = table("comparison.csv");
    let [space, variant, reference] = ["space", "variant", "reference"].map(|name| compared.column(name).unwrap());
    let mut pairs: Vec<_> = (0..space.len()).map(|row| (space[row], variant[row], reference[row])).collect();
    pairs.dedup();
    assert_eq!(
        pairs,
        [("aforce", varied, "aforce"), ("osc", "", "aforce"), ("osc", varied, "aforce,n_step=1,horizon=50"),]
    );
    let tables = std::fs::read_to_string(out.join("tables_lift.md")).unwrap();
    let row = |label: &str| tables.lines().filter(|line| line.starts_with(&format!("| `{label}` |"))).count();
    // Return, energy, comparison, safety.
    assert_eq!((row("osc"), row("osc,n_step=1,horizon=50"), row("aforce")), (4, 4, 3), "{tables}");
}
