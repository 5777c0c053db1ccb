//! What an update reports.

/// What an update reports, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses {
    /// Sum of both critics' mean squared errors, in reward^2.
    pub critic_loss: f32,
    /// mean(alpha log pi - min Q), in reward.
    pub actor_loss: f32,
    /// alpha after the update, in reward per nat.
    pub temperature: f32,
    /// -mean(log pi), in nat.
    pub entropy: f32,
    /// Mean of min Q on the policy's own actions, in reward. Climbing while returns fall means overestimation.
    pub q_mean: f32,
    /// Euclidean norm of the critics' gradient.
    pub grad_norm_critic: f32,
    /// Euclidean norm of the actor's gradient.
    pub grad_norm_actor: f32,
}

impl Losses {
    /// Whether every number is finite. If not, learning has diverged and cannot recover.
    pub fn is_finite(&self) -> bool {
        let Self { critic_loss, actor_loss, temperature, entropy, q_mean, grad_norm_critic, grad_norm_actor } = *self;
        [critic_loss, actor_loss, temperature, entropy, q_mean, grad_norm_critic, grad_norm_actor]
            .iter()
            .all(|x| x.is_finite())
    }
}

pub(crate) fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// Euclidean norm.
pub(crate) fn norm(values: &[f32]) -> f32 {
    // Eight sums side by side: one alone waits for each addition and would take a twentieth of the update.
    let mut sums = [0.0f64; 8];
    let (chunks, rest) = values.as_chunks::<8>();
    for chunk in chunks {
        for (sum, &x) in sums.iter_mut().zip(chunk) {
            *sum += f64::from(x) * f64::from(x);
        }
    }
    let rest = rest.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>();
    (sums.iter().sum::<f64>() + rest).sqrt() as f32
}
