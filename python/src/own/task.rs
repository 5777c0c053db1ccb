//! A task whose parts are methods of a Python object.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use aforce::Measurement;
use physics::camera::{Camera, Decal};
use physics::robots::Robot;
use physics::{Plant, Simulation};
use pyo3::exceptions::{PyNotImplementedError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use tasks::{Observer, Reward, RewardTerms, Start, Task, Waypoint};

use super::answer::Part;
use super::scene::Stage;
use super::start::{Drawn, Position};
use super::state::{Places, State};
use super::values::{Entry, entries, number};
use super::waypoint;

/// Names of the methods that return the observations of policy and critic.
const OBSERVE: &str = "observe";
const OBSERVE_CRITIC: &str = "observe_critic";

/// The first exception that a method of a task raised, until [`check`](Self::check) raises it in the caller.
#[derive(Clone, Default)]
pub struct Trouble(Arc<Mutex<Option<PyErr>>>);

impl Trouble {
    /// Raises the exception, if there is one.
    ///
    /// # Errors
    /// What the task's method raised.
    pub fn check(&self) -> PyResult<()> {
        self.0.lock().expect("nobody panics with it").take().map_or(Ok(()), Err)
    }

    /// Keeps `error`, unless an earlier one waits, from which this one may follow.
    pub fn keep(&self, error: PyErr) {
        self.0.lock().expect("nobody panics with it").get_or_insert(error);
    }

    /// The value of `result`. An exception is kept, and `otherwise` gives a value in its place.
    fn or<T>(&self, result: PyResult<T>, otherwise: impl FnOnce() -> T) -> T {
        result.unwrap_or_else(|error| {
            self.keep(error);
            otherwise()
        })
    }
}

/// Scaling, for the learner, of the numbers of one name.
pub struct Scaling {
    /// Typical values: one, or one for each number.
    pub centre: Vec<f64>,
    /// Typical deviations, likewise.
    pub deviation: Vec<f64>,
}

/// What a class defines for all episodes.
pub struct Sayings {
    pub name: &'static str,
    /// Name of the class, for messages.
    pub class: String,
    pub gripper: bool,
    pub achievement: &'static str,
    pub camera: Camera,
    pub scaling: HashMap<String, Scaling>,
    pub units: HashMap<String, &'static str>,
}

/// A task whose parts are methods of a Python object. What they raise waits in [`Trouble`] until the Python call that led to it raises it.
pub struct PythonTask {
    object: Py<PyAny>,
    sayings: Sayings,
    stage: Stage,
    places: Arc<Places>,
    fingers: bool,
    start: Option<Start>,
    joints: Vec<Position>,
    trouble: Trouble,
    /// The first observation of the policy and that of the critic: later ones must have the same names and lengths.
    layouts: [RefCell<Option<Vec<Entry>>>; 2],
    /// The terms of the first reward, each 0.
    terms: Option<RewardTerms>,
    /// The latest answer of the method `lost`.
    lost: bool,
}

impl PythonTask {
    pub fn new(object: Py<PyAny>, sayings: Sayings, stage: Stage, fingers: bool, trouble: Trouble) -> Self {
        let places = Arc::new(Places::new(&stage.scene, stage.first, &stage.parts, fingers));
        PythonTask {
            object,
            sayings,
            stage,
            places,
            fingers,
            start: None,
            joints: vec![],
            trouble,
            layouts: Default::default(),
            terms: None,
            lost: false,
        }
    }

    fn part<'a>(&'a self, name: &'a str) -> Part<'a> {
        Part { class: &self.sayings.class, name }
    }

    /// What the method `name` returns for a state; `None` if the class has no such method.
    fn ask<'py>(&self, py: Python<'py>, name: &str, state: &Py<State>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let method = self.object.bind(py).getattr_opt(name)?;
        method.map(|method| method.call1((state.clone_ref(py),))).transpose()
    }

    fn state(&self, py: Python<'_>, simulation: &Simulation, y: &Measurement, penalty: f64) -> PyResult<Py<State>> {
        Py::new(py, State::take(&self.places, simulation, y, penalty))
    }

    /// Calls the method `reset` and makes the simulation of the episode that it draws.
    fn draw(&mut self, py: Python<'_>, plant: &Plant, seed: u64) -> PyResult<Simulation> {
        let part = Part { class: &self.sayings.class, name: "reset" };
        let generator = py.import("numpy.random")?.call_method1("default_rng", (seed,))?;
        let drawn = self.object.bind(py).call_method1("reset", (generator,))?;
        let drawn: Drawn = if drawn.is_none() { Drawn::default() } else { part.read(&drawn, "")? };
        let mut scene = self.stage.scene.clone();
        let (start, joints) = drawn
            .lay_out(&mut scene, self.stage.first, &plant.robot, self.fingers)
            .map_err(|words| part.value(words))?;
        (self.start, self.joints) = (Some(start), joints);
        self.places = Arc::new(Places::new(&scene, self.stage.first, &self.stage.parts, self.fingers));
        Ok(Simulation::new(&scene, self.stage.tool, self.stage.site, plant))
    }

    /// Puts the numbers that the method `name` returns into `out`; after an exception zeros in the layout of its first call.
    fn show(
        &self,
        name: &'static str,
        layout: &RefCell<Option<Vec<Entry>>>,
        simulation: &Simulation,
        y: &Measurement,
        out: &mut Observer,
    ) {
        let shown = Python::attach(|py| {
            let state = self.state(py, simulation, y, 0.0)?;
            let Some(shown) = self.ask(py, name, &state)? else { return Ok(vec![]) };
            let part = self.part(name);
            let shown = entries(part, &shown)?;
            match &*layout.borrow() {
                Some(first) => same_layout(part, first, &shown)?,
                None => {
                    self.check_names(py, name, &state, &shown)?;
                    self.check_scaling(&shown)?;
                }
            }
            Ok(shown)
        });
        let zeros = || {
            let first = layout.borrow();
            let zero = |(name, numbers): &Entry| (name.clone(), vec![0.0; numbers.len()]);
            first.iter().flatten().map(zero).collect()
        };
        let shown = self.trouble.or(shown, zeros);
        for (name, numbers) in &shown {
            self.put(name, numbers, out);
        }
        layout.borrow_mut().get_or_insert(shown);
    }

    fn put(&self, name: &str, numbers: &[f64], out: &mut Observer) {
        let unit = self.sayings.units.get(name).copied().unwrap_or("");
        let scaling = self.sayings.scaling.get(name);
        let nth = |list: &[f64], i: usize| if list.len() == 1 { list[0] } else { list[i] };
        for (i, &number) in numbers.iter().enumerate() {
            let (centre, deviation) = scaling.map_or((0.0, 1.0), |s| (nth(&s.centre, i), nth(&s.deviation, i)));
            match (numbers.len(), i) {
                (1, _) => out.put(name, number, unit, centre, 1.0 / deviation),
                (3 | 4, _) => {
                    out.put(format_args!("{name}_{}", ["x", "y", "z", "w"][i]), number, unit, centre, 1.0 / deviation);
                }
                _ => out.put(format_args!("{name}_{i}"), number, unit, centre, 1.0 / deviation),
            }
        }
    }

    /// Checks that every name with typical values or a unit is observed, by the policy or by the critic. This is done
    /// once, with the policy's first observation.
    fn check_names(&self, py: Python<'_>, name: &str, state: &Py<State>, shown: &[Entry]) -> PyResult<()> {
        if name != OBSERVE {
            return Ok(());
        }
        let critic = match self.ask(py, OBSERVE_CRITIC, state)? {
            Some(shown) => entries(self.part(OBSERVE_CRITIC), &shown)?,
            None => vec![],
        };
        let of = |part, mut names: Vec<&String>| {
            names.sort();
            let known: Vec<&str> = shown.iter().chain(&critic).map(|(name, _)| name.as_str()).collect();
            names.into_iter().find(|name| !known.contains(&name.as_str())).map_or(Ok(()), |name| {
                Err(self.part(part).kind(format!("{name:?} is not observed; observed are {}", known.join(", "))))
            })
        };
        of("scaling", self.sayings.scaling.keys().collect())?;
        of("units", self.sayings.units.keys().collect())
    }

    /// Checks that a list of typical values or deviations has one number, or as many as are observed under its name.
    fn check_scaling(&self, shown: &[Entry]) -> PyResult<()> {
        for (name, numbers) in shown {
            let Some(Scaling { centre, deviation }) = self.sayings.scaling.get(name) else { continue };
            for list in [centre, deviation] {
                if list.len() != 1 && list.len() != numbers.len() {
                    let words = format!("{name:?} has {} numbers, {} are observed", list.len(), numbers.len());
                    return Err(self.part("scaling").value(words));
                }
            }
        }
        Ok(())
    }

    /// The terms of the method `reward`, and the answer of `success`.
    fn earned(&self, py: Python<'_>, state: &Py<State>) -> PyResult<Reward> {
        let part = self.part("reward");
        let reward = self.object.bind(py).call_method1("reward", (state.clone_ref(py),))?;
        let terms: Vec<(&'static str, f64)> = if let Ok(dict) = reward.cast::<PyDict>() {
            let term = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
                let Ok(name) = name.extract::<String>() else {
                    return Err(part.kind(format!("the name {} is no string", name.repr()?)));
                };
                Ok((super::for_ever(&name), number(part, &name, &value)?))
            };
            dict.iter().map(term).collect::<PyResult<_>>()?
        } else {
            vec![("reward", number(part, "reward", &reward)?)]
        };
        let terms =
            RewardTerms::of(&terms).ok_or_else(|| part.value(format!("{} terms; sixteen are allowed", terms.len())))?;
        if let Some(first) = &self.terms
            && !terms.names().eq(first.names())
        {
            let names = |terms: &RewardTerms| terms.names().collect::<Vec<_>>().join(", ");
            let words =
                format!("the terms {}, at first {}; the same ones are wanted every time", names(&terms), names(first));
            return Err(part.value(words));
        }
        let success = self.object.bind(py).call_method1("success", (state.clone_ref(py),))?;
        Ok(Reward { terms, success: self.truth("success", &success)? })
    }

    /// The answer of the method `name` as True or False.
    fn truth(&self, name: &str, answer: &Bound<'_, PyAny>) -> PyResult<bool> {
        let kind = answer.get_type().name()?;
        answer
            .extract()
            .map_err(|_: PyErr| self.part(name).kind(format!("it returned a {kind}; True or False is wanted")))
    }
}

/// Checks that an observation has the names and lengths of the first one.
fn same_layout(part: Part<'_>, first: &[Entry], now: &[Entry]) -> PyResult<()> {
    let names = |entries: &[Entry]| entries.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    if first.len() != now.len() || first.iter().zip(now).any(|(a, b)| a.0 != b.0) {
        let words = format!("the names {}, at first {}; the same ones are wanted every time", names(now), names(first));
        return Err(part.value(words));
    }
    match first.iter().zip(now).find(|(a, b)| a.1.len() != b.1.len()) {
        None => Ok(()),
        Some(((name, a), (_, b))) => Err(part.value(format!(
            "{name:?} has {} numbers, at first {}; the same ones are wanted every time",
            b.len(),
            a.len()
        ))),
    }
}

impl Task for PythonTask {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let seed = rng.next_u64();
        match Python::attach(|py| self.draw(py, plant, seed)) {
            Ok(simulation) => simulation,
            Err(error) => {
                self.trouble.keep(error);
                (self.start, self.joints) = (None, vec![]);
                Simulation::new(&self.stage.scene, self.stage.tool, self.stage.site, plant)
            }
        }
    }

    fn start(&self, robot: &Robot) -> Start {
        self.start.unwrap_or_else(|| Start::at(robot.home))
    }

    fn arrange(&self, simulation: &mut Simulation) {
        for &(joint, position) in &self.joints {
            simulation.set_joint(joint, position);
        }
    }

    fn name(&self) -> &'static str {
        self.sayings.name
    }

    fn has_gripper(&self) -> bool {
        self.sayings.gripper
    }

    fn observe(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer) {
        self.show(OBSERVE, &self.layouts[0], simulation, y, out);
    }

    fn observe_privileged(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer) {
        self.show(OBSERVE_CRITIC, &self.layouts[1], simulation, y, out);
    }

    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward {
        let earned = Python::attach(|py| {
            let state = self.state(py, simulation, y, penalty.unwrap_or(0.0))?;
            let reward = self.earned(py, &state)?;
            let lost = self.ask(py, "lost", &state)?;
            let lost = lost.map_or(Ok(false), |answer| self.truth("lost", &answer))?;
            Ok((reward, lost))
        });
        let nothing = || (Reward { terms: self.terms.unwrap_or_default(), success: false }, false);
        let (reward, lost) = self.trouble.or(earned, nothing);
        self.lost = lost;
        if self.terms.is_none() {
            let zeros: Vec<_> = reward.terms.names().map(|name| (name, 0.0)).collect();
            self.terms = RewardTerms::of(&zeros);
        }
        reward
    }

    fn lost(&self, _simulation: &Simulation, _y: &Measurement) -> bool {
        self.lost
    }

    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint {
        let wanted = Python::attach(|py| {
            let state = self.state(py, simulation, y, 0.0)?;
            let Some(wanted) = self.ask(py, "script", &state)? else {
                return Err(PyNotImplementedError::new_err(format!("{} has no script(state)", self.sayings.class)));
            };
            waypoint::read(self.part("script"), &wanted, y)
        });
        self.trouble.or(wanted, || Waypoint { pose: y.pose, grip: 0.0, force: 0.0 })
    }

    fn advance(&mut self, simulation: &Simulation, y: &Measurement) {
        let advanced = Python::attach(|py| {
            if !self.object.bind(py).hasattr("advance")? {
                return Ok(());
            }
            let state = self.state(py, simulation, y, 0.0)?;
            self.ask(py, "advance", &state).map(drop)
        });
        self.trouble.or(advanced, || ());
    }

    fn achievement(&self) -> &'static str {
        self.sayings.achievement
    }

    fn camera(&self) -> Camera {
        self.sayings.camera
    }

    fn decals(&self) -> Vec<Decal> {
        let marks = Python::attach(|py| {
            let Some(marks) = self.object.bind(py).getattr_opt("marks")? else { return Ok(vec![]) };
            let wanted = || format!("{}.marks: a list of x, y, z and a radius (m) is wanted", self.sayings.class);
            let marks: Vec<[f64; 4]> = marks.call0()?.extract().map_err(|_: PyErr| PyTypeError::new_err(wanted()))?;
            if marks.iter().flatten().any(|number| !number.is_finite()) {
                return Err(PyValueError::new_err(format!("{}, all finite", wanted())));
            }
            Ok(marks
                .into_iter()
                .map(|[x, y, z, radius]| Decal { centre: [x, y, z], radius, color: [40, 120, 200] })
                .collect())
        });
        self.trouble.or(marks, Vec::new)
    }
}
