//! Several environments that take their actions at the same time.

use std::path::PathBuf;
use std::sync::Mutex;

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tasks::Step;

use crate::arrays;
use crate::episodes::{Episodes, NUMBERS};
use crate::exclusive::Exclusive;
use crate::value_error;

/// The environments, each with its latest step; `None` after a reset.
struct Fleet {
    members: Vec<(Episodes, Option<Step>)>,
    threads: usize,
}

impl Fleet {
    /// Runs `work` on every member, on all threads. The threads are started for each call, so that a forked process lacks none of
    /// them; starting a thread takes a fraction of an action's time.
    fn each(&mut self, work: impl Fn(usize, &mut Episodes) -> Option<Step> + Sync) {
        let next = Mutex::new(self.members.iter_mut().enumerate());
        let worker = || {
            loop {
                let member = next.lock().expect("no member panics while it is handed out").next();
                let Some((index, (episodes, step))) = member else { return };
                *step = work(index, episodes);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.threads {
                scope.spawn(worker);
            }
            worker();
        });
    }

    fn rows<'py>(&self, py: Python<'py>, of: impl Fn(&Episodes) -> Vec<f32>) -> Bound<'py, PyArray2<f32>> {
        let rows: Vec<f32> = self.members.iter().flat_map(|(episodes, _)| of(episodes)).collect();
        let shape = (self.members.len(), rows.len() / self.members.len());
        Array2::from_shape_vec(shape, rows).expect("rows of one length").into_pyarray(py)
    }

    /// Raises what a task's method raised in one of the members.
    fn check(&mut self) -> PyResult<()> {
        let every = self.members.iter_mut().map(|(episodes, _)| episodes.check());
        // Every member is checked: an exception left in a second member would be raised by a later call.
        every.fold(Ok(()), Result::and)
    }

    /// Info of every member's latest step; 0 and false for members that were reset.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let info = PyDict::new(py);
        info.set_item("is_success", self.column(py, |step| step.success))?;
        info.set_item("stopped", self.column(py, |step| step.interval.stop.is_some()))?;
        info.set_item("diverged", self.column(py, |step| step.diverged))?;
        for (name, of) in NUMBERS {
            info.set_item(name, self.column(py, of))?;
        }
        let terms = PyDict::new(py);
        for term in self.members[0].0.env.reward_terms() {
            terms.set_item(term, self.column(py, |step| step.reward_terms.value(term)))?;
        }
        info.set_item("reward_terms", terms)?;
        if !self.members[0].0.env.privileged_components().is_empty() {
            info.set_item("critic", self.rows(py, Episodes::privileged))?;
        }
        Ok(info)
    }

    /// A number of every member's latest step; 0 for members that were reset.
    fn column<'py, T: numpy::Element + Default>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Step) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.members.iter().map(|(_, step)| step.as_ref().map_or_else(T::default, &of)))
    }
}

/// Observations, rewards, terminated, truncated, numbers of info.
type Stepped<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyDict>,
);

/// A vector of environments; Gymnasium's interface is `aforce.VectorEnv`.
#[pyclass(frozen)]
pub struct Vector(Exclusive<Fleet>);

#[pymethods]
impl Vector {
    #[new]
    fn new(
        count: usize,
        threads: usize,
        task: &Bound<'_, PyAny>,
        config: Option<PathBuf>,
        keywords: &Bound<'_, PyDict>,
        scaled: bool,
    ) -> PyResult<Self> {
        if count == 0 || threads == 0 {
            return Err(PyValueError::new_err("num_envs and threads must be at least 1"));
        }
        let member = || Episodes::new(task, config.clone(), keywords, scaled).map(|episodes| (episodes, None));
        let members = (0..count).map(|_| member()).collect::<PyResult<Vec<_>>>()?;
        Ok(Self(Exclusive::new(Fleet { members, threads: threads.min(count) })))
    }

    /// Starts an episode in each environment that `which` names, and returns all observations and info.
    fn reset<'py>(
        &self,
        py: Python<'py>,
        seeds: Vec<Option<u64>>,
        which: Vec<bool>,
    ) -> PyResult<(Bound<'py, PyArray2<f32>>, Bound<'py, PyDict>)> {
        self.0.with(|fleet| {
            py.detach(|| {
                fleet.each(|index, episodes| {
                    if which[index] {
                        episodes.reset(seeds[index]);
                    }
                    None
                });
            });
            fleet.check()?;
            Ok((fleet.rows(py, Episodes::observation), fleet.info(py)?))
        })
    }

    /// Every environment takes its action, but those that `reset` names begin an episode instead, with a reward of 0.
    fn step<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>, reset: Vec<bool>) -> PyResult<Stepped<'py>> {
        self.0.with(|fleet| {
            for (episodes, _) in &fleet.members {
                episodes.seed()?;
            }
            let dim = fleet.members[0].0.env.action_dim();
            let actions = arrays::action(actions, &[fleet.members.len(), dim])?;
            py.detach(|| {
                fleet.each(|index, episodes| {
                    if reset[index] {
                        episodes.reset(None);
                        None
                    } else {
                        Some(episodes.step(&actions[index * dim..][..dim]))
                    }
                });
            });
            fleet.check()?;
            let info = fleet.info(py)?;
            Ok((
                fleet.rows(py, Episodes::observation),
                fleet.column(py, |step| step.reward),
                fleet.column(py, |step| step.terminated),
                fleet.column(py, |step| step.truncated),
                info,
            ))
        })
    }

    /// What the task's script would do now, a row for each environment.
    fn expert_actions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.0.with(|fleet| {
            for (episodes, _) in &fleet.members {
                episodes.seed()?;
            }
            let dim = fleet.members[0].0.env.action_dim();
            let members = &mut fleet.members;
            let actions: Vec<f32> = py.detach(|| {
                let of_member = |(episodes, _): &mut (Episodes, _)| episodes.env.expert_action();
                members.iter_mut().flat_map(of_member).map(|entry| entry as f32).collect()
            });
            fleet.members.iter().map(|(episodes, _)| episodes.check_query()).fold(Ok(()), Result::and)?;
            Ok(Array2::from_shape_vec((fleet.members.len(), dim), actions).map_err(value_error)?.into_pyarray(py))
        })
    }

    /// Seeds of the present episodes.
    fn episode_seeds(&self) -> PyResult<Vec<u64>> {
        self.0.with(|fleet| fleet.members.iter().map(|(episodes, _)| episodes.seed()).collect())
    }

    /// Description of one environment, for all are alike, as JSON.
    fn describe(&self) -> PyResult<String> {
        self.0.with(|fleet| fleet.members[0].0.describe())
    }

    fn close(&self) -> PyResult<()> {
        self.0.close()
    }
}
