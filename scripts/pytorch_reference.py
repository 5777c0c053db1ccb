#!/usr/bin/env python3
"""Hold the learner of crates/sac against PyTorch: SAC by autograd and torch.optim.Adam, written from the papers and not from the Rust code.

    python3 scripts/pytorch_reference.py             # records crates/sac/reference/pytorch*.safetensors, which `cargo test -p sac` reads
    python3 scripts/pytorch_reference.py --time      # times this learner, ours (criterion), and this one again, one thread each

Needs `pip install torch==2.11.0 numpy safetensors` in a virtual environment; without a GPU. Times mean something only if nothing else runs.

There are two records: in one the critics see what the actor sees, in the other they see PRIVILEGED numbers more, which stand behind the actor's in
an observation. A record holds three updates of a small learner on fixed weights, batches and noise: inputs under `NAME@0` (weights) and
`batch.NAME@T`, all that update T leaves under `NAME@T` (T = 1, 2, 3). It is computed in f64 and rounded to f32, so that the Rust learner differs
from it by its own rounding. The script prints how much PyTorch in f32 differs. The first record also holds the mean actions that PyTorch gives for
the checkpoint in crates/sac/reference/checkpoint, which Rust wrote (see crates/sac/src/pytorch.rs). A second run writes the same bytes.
"""

import argparse
import copy
import itertools
import json
import math
import platform
import statistics
import subprocess
import time
from pathlib import Path

import numpy
import safetensors
import torch
from safetensors.torch import load_file, save
from torch import nn
from torch.distributions import Normal, TanhTransform
from torch.nn.functional import mse_loss

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "crates" / "sac" / "reference"
CHECKPOINT = REFERENCE / "checkpoint"

# Named as in `sac::Config`, which the Rust test reads from the record. No two rates are equal, so that none can stand in for another.
CONFIG = {
    "hidden": [16, 16],
    "batch_size": 8,
    "actor_learning_rate": 1e-3,
    "critic_learning_rate": 3e-3,
    "temperature_learning_rate": 5e-3,
    "gamma": 0.97,
    "n_step": 3,
    "tau": 0.01,
    "target_period": 2,
    "initial_temperature": 0.2,
    "target_entropy": -2.5,
    "log_std_min": -4.0,
    "log_std_max": 1.5,
}
OBSERVATIONS, PRIVILEGED, ACTIONS, UPDATES = 5, 4, 3, 3


def mlp(*sizes):
    layers = [layer for i, o in itertools.pairwise(sizes) for layer in (nn.Linear(i, o), nn.ReLU())]
    return nn.Sequential(*layers[:-1])


class Learner:
    """SAC. One update moves the critics, the actor, the temperature and the targets, in this order. It weighs entropy by the temperature
    from before the update, samples next and present actions from the actor from before the update, and takes the actor's loss from the updated
    critics."""

    def __init__(self, config, observations, actions, privileged=0, **adam):
        self.config, self.observations = config, observations
        self.actor = mlp(observations, *config["hidden"], 2 * actions)
        self.critics = nn.ModuleList(mlp(observations + privileged + actions, *config["hidden"], 1) for _ in range(2))
        self.targets = copy.deepcopy(self.critics)
        self.log_temperature = nn.Parameter(torch.tensor([math.log(config["initial_temperature"])]))
        self.updates = 0

        def optimizer(what, parameters):
            return torch.optim.Adam(parameters, lr=config[f"{what}_learning_rate"], **adam)

        self.actor_adam = optimizer("actor", self.actor.parameters())
        self.critic_adam = optimizer("critic", self.critics.parameters())
        self.temperature_adam = optimizer("temperature", [self.log_temperature])

    def policy(self, observation, noise):
        """A tanh-squashed Gaussian: the action that the standard normal `noise` leads to, and its log-probability. The actor sees the first
        part of an observation."""
        mean, raw = self.actor(observation[:, : self.observations]).chunk(2, dim=-1)
        low, high = self.config["log_std_min"], self.config["log_std_max"]
        log_std = low + 0.5 * (high - low) * (torch.tanh(raw) + 1)
        gaussian, squash = Normal(mean, log_std.exp(), validate_args=False), TanhTransform()
        u = mean + log_std.exp() * noise
        action = squash(u)
        return action, (gaussian.log_prob(u) - squash.log_abs_det_jacobian(u, action)).sum(-1)

    def update(self, batch, gradients=None):
        """One update. Notes the gradients of actor and critics in `gradients`, if given."""
        self.updates += 1
        alpha = self.log_temperature.detach().exp()

        with torch.no_grad():
            next_action, next_log_prob = self.policy(batch["next_observation"], batch["next_noise"])
            next_input = torch.cat([batch["next_observation"], next_action], dim=-1)
            next_q = torch.minimum(*(target(next_input) for target in self.targets)).squeeze(-1)
            y = batch["reward"] + batch["discount"] * (next_q - alpha * next_log_prob)
        present = torch.cat([batch["observation"], batch["action"]], dim=-1)
        critic_loss = sum(mse_loss(critic(present).squeeze(-1), y) for critic in self.critics)
        self.critic_adam.zero_grad()
        critic_loss.backward()
        if gradients is not None:
            gradients |= {name: p.grad.clone() for name, p in self.critic_parameters(self.critics)}
        self.critic_adam.step()

        action, log_prob = self.policy(batch["observation"], batch["noise"])
        own = torch.cat([batch["observation"], action], dim=-1)
        q = torch.minimum(*(critic(own) for critic in self.critics)).squeeze(-1)
        actor_loss = (alpha * log_prob - q).mean()
        self.actor_adam.zero_grad()
        actor_loss.backward()
        if gradients is not None:
            gradients |= {name: p.grad.clone() for name, p in self.actor_parameters()}
        self.actor_adam.step()

        excess = (-log_prob - self.config["target_entropy"]).detach()
        temperature_loss = (self.log_temperature.exp() * excess).mean()
        self.temperature_adam.zero_grad()
        temperature_loss.backward()
        self.temperature_adam.step()

        if self.updates % self.config["target_period"] == 0:
            with torch.no_grad():
                for target, critic in zip(self.targets.parameters(), self.critics.parameters()):
                    target.lerp_(critic, self.config["tau"])
        return {"critic_loss": critic_loss, "actor_loss": actor_loss, "entropy": -log_prob.mean(), "q_mean": q.mean()}

    def actor_parameters(self):
        return [(f"actor.{name}", p) for name, p in self.actor.named_parameters()]

    @staticmethod
    def critic_parameters(critics):
        return [(f"critic_{k}.{name}", p) for k, critic in enumerate(critics, 1) for name, p in critic.named_parameters()]

    def state(self):
        """Every weight, moment and target, under the names of a checkpoint."""
        adams = [
            (self.actor_adam, self.actor_parameters()),
            (self.critic_adam, self.critic_parameters(self.critics)),
            (self.temperature_adam, [("log_temperature", self.log_temperature)]),
        ]
        state = {f"{name}.target": p for name, p in self.critic_parameters(self.targets)}
        for adam, parameters in adams:
            for name, p in parameters:
                state[name] = p
                if p in adam.state:
                    state[f"{name}.adam_m"], state[f"{name}.adam_v"] = (adam.state[p][k] for k in ("exp_avg", "exp_avg_sq"))
        return {name: tensor.detach().clone() for name, tensor in state.items()}

    def load(self, state):
        with torch.no_grad():
            for name, p in self.actor_parameters() + self.critic_parameters(self.critics):
                p.copy_(state[name])
            for name, p in self.critic_parameters(self.targets):
                p.copy_(state[f"{name}.target"])


def draw_batches(privileged):
    """Rows as an n-step memory hands them out: a discount of gamma^k after k rewards, and 0 after a termination."""
    rng = numpy.random.default_rng(1)
    n, batches = CONFIG["batch_size"], []
    for _ in range(UPDATES):
        batch = {
            "observation": rng.normal(size=(n, OBSERVATIONS + privileged)),
            "action": rng.uniform(-1, 1, size=(n, ACTIONS)),
            "next_observation": rng.normal(size=(n, OBSERVATIONS + privileged)),
            "reward": rng.normal(size=n),
            "discount": CONFIG["gamma"] ** numpy.array([3, 3, 3, 1, 2, 3, 3, 3]) * (numpy.arange(n) != 5),
            "next_noise": rng.normal(size=(n, ACTIONS)),
            "noise": rng.normal(size=(n, ACTIONS)),
        }
        batches.append({name: torch.from_numpy(values.astype(numpy.float32)) for name, values in batch.items()})
    return batches


def learn(start, batches, privileged, dtype):
    """What each update leaves, under `NAME@T`, computed in `dtype`."""
    torch.set_default_dtype(dtype)
    learner, record = Learner(CONFIG, OBSERVATIONS, ACTIONS, privileged), {}
    learner.load(start)
    for t, batch in enumerate(batches, 1):
        gradients = {}
        result = learner.update({name: values.to(dtype) for name, values in batch.items()}, gradients)
        result |= learner.state() | {f"{name}.gradient": g for name, g in gradients.items()}
        record |= {f"{name}@{t}": values.detach().clone() for name, values in result.items()}
    torch.set_default_dtype(torch.float32)
    return record


def checkpoint_actions():
    """PyTorch's mean actions for the checkpoint that Rust wrote, and the observations; checks that Rust noted the same actions in it."""
    state = json.loads((CHECKPOINT / "state.json").read_text())
    actor = mlp(state["observation_dim"], *state["config"]["hidden"], 2 * state["action_dim"])
    weights = load_file(CHECKPOINT / "actor.safetensors")
    actor.load_state_dict({name.removeprefix("actor."): tensor for name, tensor in weights.items()})
    observations, by_rust = (torch.tensor(state["caller"][key]) for key in ("observations", "mean_actions"))
    with torch.no_grad():
        actions = torch.tanh(actor(observations)[:, : state["action_dim"]])
    difference = (actions - by_rust).abs().max().item()
    print(f"mean actions of the checkpoint written by Rust: largest difference {difference:.1e}")
    assert difference < 1e-6, "the checkpoint means something else to PyTorch"
    return observations, actions


def write_record(file, privileged=0):
    torch.manual_seed(1)
    start = Learner(CONFIG, OBSERVATIONS, ACTIONS, privileged).state()
    # Targets that differ from the critics, as in the middle of a run.
    start |= {name: w + 0.05 * torch.randn_like(w) for name, w in start.items() if name.endswith(".target")}
    batches = draw_batches(privileged)
    exact, single = (learn(start, batches, privileged, dtype) for dtype in (torch.float64, torch.float32))

    off = {}
    for name, values in exact.items():
        kind = name.partition("@")[0].rpartition(".")[2]
        error = ((single[name] - values).abs().max() / values.abs().max()).item()
        off[kind] = max(off.get(kind, 0), error)
    print("PyTorch in f32, largest error relative to a tensor's largest entry:")
    print("\n".join(f"  {kind:16} {error:.1e}" for kind, error in off.items()))

    record = {f"{name}@0": values for name, values in start.items() if name != "log_temperature"}
    record |= {f"batch.{name}@{t}": values for t, batch in enumerate(batches, 1) for name, values in batch.items()}
    record |= {name: values.float() for name, values in exact.items()}
    if not privileged:
        record["checkpoint.observations"], record["checkpoint.mean_actions"] = checkpoint_actions()
    about = {
        "command": "python3 scripts/pytorch_reference.py",
        "python": platform.python_version(),
        "torch": torch.__version__.partition("+")[0],
        "numpy": numpy.__version__,
        "safetensors": safetensors.__version__,
        "config": CONFIG,
    }
    if privileged:
        about["privileged"] = privileged
    path = REFERENCE / file
    path.parent.mkdir(exist_ok=True)
    metadata = {"about": json.dumps(about)}  # one entry: the order of several changes from run to run
    path.write_bytes(save({name: values.contiguous() for name, values in record.items()}, metadata))
    print(f"wrote {path.relative_to(ROOT)}, {path.stat().st_size} bytes")


def time_updates(seconds=10.0):
    """Times updates at the sizes of `256x2-batch-256` in crates/sac/benches/update.rs, each with a batch drawn from 20,000 transitions."""
    observations, actions, n = 42, 7, 256
    config = CONFIG | {"hidden": [256, 256], "batch_size": n, "target_period": 1, "target_entropy": -actions}
    widths = {"observation": observations, "action": actions, "next_observation": observations}
    memory = {name: torch.rand(20_000, width) * 2 - 1 for name, width in widths.items()}
    memory |= {"reward": torch.rand(20_000), "discount": torch.full((20_000,), 0.97**3)}
    for label, adam in (("Adam as is", {}), ("fused Adam", {"fused": True})):
        learner, times = Learner(config, observations, actions, **adam), []
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            start = time.perf_counter()
            rows = torch.randint(20_000, (n,))
            batch = {name: values[rows] for name, values in memory.items()}
            learner.update(batch | {name: torch.randn(n, actions) for name in ("next_noise", "noise")})
            times.append(1e3 * (time.perf_counter() - start))
        times = times[len(times) // 5 :]  # the first fifth warms up
        print(f"PyTorch, {label}: median {statistics.median(times):.2f} ms, fastest {min(times):.2f} ms, {len(times)} updates")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--time", action="store_true", help="time an update instead: PyTorch, ours, PyTorch again")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long each PyTorch learner is timed (default 10)")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    if not arguments.time:
        write_record("pytorch.safetensors")
        return write_record("pytorch_asymmetric.safetensors", PRIVILEGED)
    time_updates(arguments.seconds)
    subprocess.run(["cargo", "bench", "-p", "sac", "--bench", "update", "--", "12", "256x2-batch-256"], cwd=ROOT, check=True)
    time_updates(arguments.seconds)


if __name__ == "__main__":
    main()
