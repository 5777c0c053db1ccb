//! A kept policy, played without libtorch: a perceptron with ReLU between its layers, and tanh of the mean.

use serde::Deserialize;
use serde_json::{Map, Value};
use tasks::{Env, EnvConfig};

/// Run, settings and weights of every kept policy that the page has.
const KEPT: &[(&str, &str, &[u8])] = &include!(concat!(env!("OUT_DIR"), "/policies.rs"));

/// What is read of a run's `config.toml`.
#[derive(Deserialize)]
struct RunConfig {
    env: EnvConfig,
    learner: Learner,
}

#[derive(Deserialize)]
struct Learner {
    scaled_observations: bool,
}

/// The actor of a checkpoint.
pub struct Policy {
    /// The policy's run, below `results/`.
    pub run: &'static str,
    /// Settings of the environment in which the policy was trained.
    pub env: EnvConfig,
    scaled: bool,
    layers: Vec<Layer>,
}

/// y = W x + b.
struct Layer {
    /// Row-major; a row has as many numbers as there are inputs.
    weight: Vec<f32>,
    bias: Vec<f32>,
}

impl Policy {
    /// The runs of all kept policies.
    pub fn runs() -> impl Iterator<Item = &'static str> {
        KEPT.iter().map(|kept| kept.0)
    }

    /// The policy of a run.
    ///
    /// # Errors
    /// A sentence, if there is no such policy or it cannot be read.
    pub fn of(run: &str) -> Result<Policy, String> {
        let Some((run, config, weights)) = KEPT.iter().find(|kept| kept.0 == run) else {
            let known = Policy::runs().collect::<Vec<_>>().join(", ");
            return Err(format!("There is no policy {run:?} here. There are script, hold, {known}."));
        };
        let config: RunConfig = toml::from_str(config).map_err(|problem| format!("{run}: {problem}"))?;
        let layers = layers(weights).ok_or_else(|| format!("{run}: its weights cannot be read."))?;
        Ok(Policy { run, env: config.env, scaled: config.learner.scaled_observations, layers })
    }

    /// The mean action in the present state, each entry in [-1, 1].
    pub fn act(&self, env: &Env) -> Vec<f64> {
        let mut observation = env.observation().to_vec();
        if self.scaled {
            tasks::scale(env.observation_components(), &mut observation);
        }
        self.answer(&observation).into_iter().map(f64::from).collect()
    }

    /// Whether the policy's inputs and outputs have the lengths of the environment's observations and actions.
    pub fn fits(&self, env: &Env) -> bool {
        let (first, last) = (&self.layers[0], &self.layers[self.layers.len() - 1]);
        let inputs = first.weight.len() / first.bias.len();
        (inputs, last.bias.len()) == (env.observation().len(), 2 * env.action_dim())
    }

    /// The mean action for an observation as the policy sees it.
    pub fn answer(&self, observation: &[f32]) -> Vec<f32> {
        let (last, hidden) = self.layers.split_last().expect("a policy has layers");
        let relu = |x: Vec<f32>, layer: &Layer| layer.of(&x).into_iter().map(|y| y.max(0.0)).collect();
        let output = last.of(&hidden.iter().fold(observation.to_vec(), relu));
        // The output has the mean of each entry, then the logarithm of each standard deviation.
        output[..output.len() / 2].iter().map(|mean| libm::tanhf(*mean)).collect()
    }
}

impl Layer {
    fn of(&self, x: &[f32]) -> Vec<f32> {
        let rows = self.weight.chunks_exact(x.len()).zip(&self.bias);
        rows.map(|(row, bias)| row.iter().zip(x).fold(*bias, |sum, (w, x)| sum + w * x)).collect()
    }
}

/// The layers `actor.0`, `actor.2`, ... of a safetensors file: its header's length, the header in JSON, the numbers.
fn layers(file: &[u8]) -> Option<Vec<Layer>> {
    let (length, rest) = file.split_first_chunk::<8>()?;
    let (header, numbers) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    let header: Map<String, Value> = serde_json::from_slice(header).ok()?;
    let tensor = |name: String| -> Option<Vec<f32>> {
        let ends = header.get(&name)?.get("data_offsets")?;
        let at = |end: usize| usize::try_from(ends.get(end)?.as_u64()?).ok();
        let bytes = numbers.get(at(0)?..at(1)?)?;
        Some(bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
    };
    let weights = header.keys().filter(|name| name.ends_with(".weight")).count();
    let layer = |k: usize| {
        let [weight, bias] = ["weight", "bias"].map(|kind| tensor(format!("actor.{}.{kind}", 2 * k)));
        Some(Layer { weight: weight?, bias: bias? })
    };
    (0..weights).map(layer).collect::<Option<Vec<_>>>().filter(|layers| !layers.is_empty())
}
