//! One environment.

use std::path::PathBuf;

use numpy::ndarray::Array3;
use numpy::{Element, IntoPyArray, PyArray1, PyArray3};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use show::page;
use tasks::{Pixels, Step};

use crate::arrays;
use crate::episodes::{Episodes, NUMBERS};
use crate::exclusive::Exclusive;
use crate::value_error;

/// Observation, reward, terminated, truncated, info.
type Stepped<'py> = (Bound<'py, PyArray1<f32>>, f64, bool, bool, Bound<'py, PyDict>);

/// An environment; Gymnasium's interface is `aforce.Env`.
#[pyclass(frozen)]
pub struct Env(Exclusive<Episodes>);

#[pymethods]
impl Env {
    #[new]
    fn new(
        task: &Bound<'_, PyAny>,
        config: Option<PathBuf>,
        keywords: &Bound<'_, PyDict>,
        scaled: bool,
    ) -> PyResult<Self> {
        Episodes::new(task, config, keywords, scaled).map(|episodes| Self(Exclusive::new(episodes)))
    }

    fn reset<'py>(
        &self,
        py: Python<'py>,
        seed: Option<u64>,
    ) -> PyResult<(Bound<'py, PyArray1<f32>>, Bound<'py, PyDict>)> {
        self.0.with(|episodes| {
            py.detach(|| episodes.reset(seed));
            episodes.check()?;
            let info = info(py, &episodes.env, None)?;
            add_privileged(&info, episodes)?;
            Ok((PyArray1::from_vec(py, episodes.observation()), info))
        })
    }

    fn step<'py>(&self, py: Python<'py>, action: &Bound<'py, PyAny>) -> PyResult<Stepped<'py>> {
        self.0.with(|episodes| {
            episodes.seed()?;
            let action = arrays::action(action, &[episodes.env.action_dim()])?;
            let (step, observation) = py.detach(|| (episodes.step(&action), episodes.observation()));
            episodes.check()?;
            let info = info(py, &episodes.env, Some(&step))?;
            add_privileged(&info, episodes)?;
            let observation = PyArray1::from_vec(py, observation);
            Ok((observation, step.reward, step.terminated, step.truncated, info))
        })
    }

    /// What the observed camera sees now; shape (height, width, 1 or 3); None if no camera is observed.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.0.with(|episodes| {
            episodes.seed()?;
            let Some(camera) = episodes.env.config().observation.camera else { return Ok(None) };
            let shape = |channels| (camera.height as usize, camera.width as usize, channels);
            let env = &mut episodes.env;
            let pixels = py.detach(move || env.pixels());
            episodes.check_query()?;
            Ok(match pixels {
                None => None,
                Some(Pixels::Depth(depths)) => Some(array(py, shape(1), depths)?),
                Some(Pixels::Rgb(rgb)) => Some(array(py, shape(3), rgb)?),
            })
        })
    }

    fn expert_action<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        self.0.with(|episodes| {
            episodes.seed()?;
            let env = &mut episodes.env;
            let action = py.detach(move || env.expert_action());
            episodes.check_query()?;
            Ok(PyArray1::from_iter(py, action.into_iter().map(|v| v as f32)))
        })
    }

    /// Seed of the present episode.
    fn episode_seed(&self) -> PyResult<u64> {
        self.0.with(|episodes| episodes.seed())
    }

    /// Description as JSON.
    fn describe(&self) -> PyResult<String> {
        self.0.with(|episodes| episodes.describe())
    }

    fn render<'py>(&self, py: Python<'py>, width: usize, height: usize) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let rgb = self.0.with(|episodes| {
            episodes.seed()?;
            let env = &mut episodes.env;
            let rgb = py.detach(move || {
                let task = env.task();
                task.camera().render(env.simulation(), &task.decals(), width, height).rgb
            });
            episodes.check_query()?;
            Ok(rgb)
        })?;
        Ok(Array3::from_shape_vec((height, width, 3), rgb).map_err(value_error)?.into_pyarray(py))
    }

    /// Episodes are recorded from the next reset on.
    fn record(&self) -> PyResult<()> {
        self.0.with(|episodes| {
            episodes.records = true;
            Ok(())
        })
    }

    /// Writes the present episode, played by `who`, as a page; false if nothing of it is recorded.
    fn write_page(&self, path: PathBuf, who: &str) -> PyResult<bool> {
        self.0.with(|episodes| {
            let Some(playback) = episodes.playback.as_mut().filter(|playback| playback.traces.actions() > 0) else {
                return Ok(false);
            };
            playback.end(&episodes.env, who);
            page::write(&path, std::slice::from_ref(playback), &[])
                .map_err(|error| PyOSError::new_err(format!("{error:#}")))?;
            Ok(true)
        })
    }

    fn close(&self) -> PyResult<()> {
        self.0.close()
    }
}

fn array<'py, T: Element>(
    py: Python<'py>,
    shape: (usize, usize, usize),
    pixels: Vec<T>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(Array3::from_shape_vec(shape, pixels).map_err(value_error)?.into_pyarray(py).into_any())
}

/// Adds the critic's numbers, if there are any.
fn add_privileged(info: &Bound<'_, PyDict>, episodes: &Episodes) -> PyResult<()> {
    let privileged = episodes.privileged();
    if privileged.is_empty() {
        return Ok(());
    }
    info.set_item("critic", PyArray1::from_vec(info.py(), privileged))
}

/// What an action led to besides observation and reward; 0 and false before the first action.
fn info<'py>(py: Python<'py>, env: &tasks::Env, step: Option<&Step>) -> PyResult<Bound<'py, PyDict>> {
    let info = PyDict::new(py);
    info.set_item("is_success", step.is_some_and(|step| step.success))?;
    info.set_item("stopped", step.is_some_and(|step| step.interval.stop.is_some()))?;
    info.set_item("diverged", step.is_some_and(|step| step.diverged))?;
    for (name, of) in NUMBERS {
        info.set_item(name, step.map_or(0.0, of))?;
    }
    let parts = PyDict::new(py);
    for term in env.reward_terms() {
        parts.set_item(term, step.map_or(0.0, |step| step.reward_terms.value(term)))?;
    }
    info.set_item("reward_terms", parts)?;
    Ok(info)
}
