//! What runs earned against what they spent: a dot per run.

use show::plot::{Panel, Series};

use tasks::TaskName;

use crate::config::label;
use crate::report::groups::{Group, Section};
use crate::report::summary::RunSummary;

/// A panel per task of `experiment` and preset, with every run of every group: another preset may train for another time, and what a
/// run ends with is then another thing. Tasks are in their usual order.
pub fn energy_and_return(experiment: &str, sections: &[Section], groups: &[Group]) -> Vec<Panel> {
    let tasks = TaskName::all();
    let place = |section: &&Section| tasks.iter().position(|task| task.as_str() == section.task);
    let mut of_experiment: Vec<_> = sections.iter().filter(|section| section.experiment == experiment).collect();
    of_experiment.sort_by_key(place);
    of_experiment.into_iter().flat_map(|section| panels(section, groups)).collect()
}

fn panels(section: &Section, groups: &[Group]) -> Vec<Panel> {
    let of_section = || groups.iter().filter(|group| group.section == *section);
    let mut presets: Vec<&str> = vec![];
    for group in of_section() {
        if !presets.contains(&group.preset) {
            presets.push(group.preset);
        }
    }
    let several = presets.len() > 1;
    let panel = |preset: &str| Panel {
        title: if several { format!("{}, preset {preset}", section.title()) } else { section.title() },
        x_label: "J per action, training".into(),
        y_label: "final return".into(),
        series: of_section().filter(|group| group.preset == preset).map(dots).collect(),
        from_zero: true,
        ..Panel::default()
    };
    presets.into_iter().map(panel).collect()
}

fn dots(group: &Group) -> Series {
    let dot = |run: &RunSummary| (run.number("energy_per_action_j"), run.number("final_return"));
    let is_known = |dot: &(f64, f64)| !dot.0.is_nan() && !dot.1.is_nan();
    Series {
        label: label(group.space, group.variant),
        dots: group.runs.iter().map(|run| dot(run)).filter(is_known).collect(),
        ..Series::default()
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;
    use crate::report::groups::{
        groups, sections,
        tests::{runs, set},
    };

    #[test]
    fn every_run_is_one_dot_in_the_panel_of_its_task_and_preset() {
        let mut all = runs("aforce", 3);
        all.extend(runs("osc", 2));
        let mut other_preset = runs("osc", 1);
        other_preset[0].preset = "paper".into();
        all.extend(other_preset);
        let mut door = runs("osc", 1);
        door[0].task = "door".into();
        set(&mut door[0], "energy_per_action_j", Cell::Real(2.5));
        all.extend(door);
        let groups = groups(&all);
        let panels = energy_and_return("", &sections(&groups), &groups);
        let dots = |panel: &Panel| panel.series.iter().map(|series| series.dots.len()).collect::<Vec<_>>();
        let usual = format!("Lift, preset {}", all[0].preset);
        assert_eq!((panels[0].title.as_str(), dots(&panels[0])), (usual.as_str(), vec![3, 2]));
        assert_eq!((panels[1].title.as_str(), dots(&panels[1])), ("Lift, preset paper", vec![1]));
        assert_eq!((panels[2].title.as_str(), dots(&panels[2])), ("Door", vec![1]));
        assert_eq!(panels[2].series[0].dots, [(2.5, 60.0)]);
    }
}
