"""PPO of Stable-Baselines3 with the sizes of our `ppo`, on one thread: TASK STEPS."""

import sys

import torch
from stable_baselines3 import PPO

torch.set_num_threads(1)
task, steps = sys.argv[1], int(sys.argv[2])
model = PPO("MlpPolicy", task, learning_rate=3e-4, n_steps=2048, batch_size=64, n_epochs=10,
            gamma=0.99, gae_lambda=0.95, clip_range=0.2, ent_coef=0.0, max_grad_norm=0.5,
            policy_kwargs={"net_arch": [64, 64], "activation_fn": torch.nn.Tanh}, device="cpu",
            seed=0)
model.learn(steps)
