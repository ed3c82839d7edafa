"""A policy from a file in the safetensors layout, and Option2Vec's networks at a state.

Names and shapes of tensors are those of docs/formats.md, networks those of spec 2.6 and 2.7.
"""

import json
import struct
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from option2vec_results.records import DamagedFile

TYPES = {"F32": "<f4", "F64": "<f8", "I64": "<i8"}


@dataclass(frozen=True)
class Policy:
    """Parameters by name, as in the file: W (out, in), vectors (n, 1)."""
    path: Path
    metadata: Mapping[str, str]
    tensors: Mapping[str, np.ndarray]

    @cached_property
    def config(self) -> dict[str, Any]:
        """The resolved configuration of the run that made it; {} where the file has none."""
        return tomllib.loads(self.metadata.get("config", ""))

    def normalise(self, observation: np.ndarray) -> np.ndarray:
        """(S) as the simulator gives it -> s (S) as the networks take it."""
        mean, var = (self.tensors[f"normalizer.{name}"][:, 0] for name in ("mean", "var"))
        return np.clip((observation - mean) / np.sqrt(var + 1e-8), -10, 10)


def load_policy(file: str | Path) -> Policy:
    """A checkpoint, an exported policy, or any other file of F32, F64 and I64 tensors."""
    path = Path(file)
    text = path.read_bytes()
    try:
        length, = struct.unpack_from("<Q", text)
        header = json.loads(text[8:8 + length])
        metadata = header.pop("__metadata__", {})
        tensors = {name: _tensor(text[8 + length:], **entry) for name, entry in header.items()}
    except (struct.error, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DamagedFile(f"{path}: not a whole safetensors file: {error}") from None
    return Policy(path, metadata, tensors)


def _tensor(data: bytes, dtype: str, shape: list[int], data_offsets: list[int]) -> np.ndarray:
    begin, end = data_offsets
    if not 0 <= begin <= end <= len(data):
        raise ValueError(f"data [{begin}, {end}) is not inside the {len(data)} bytes of data")
    return np.frombuffer(data[begin:end], TYPES[dtype]).reshape(shape)


def forward(policy: Policy, s: np.ndarray, o_prev: int, init: bool, o: int
            ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s (S) normalised -> P (K) of the option policy, mu and sigma (A) of the action policy with
    option o, as `option2vec forward` writes them. Options count from 0; init: the first step of an
    episode, where o_prev counts for nothing."""
    if "embed.W_o" not in policy.tensors:
        raise ValueError(f"{policy.path}: has no embed.W_o; only Option2Vec's networks are here")
    numbers = policy.config["algo"]["option2vec"]
    W_o = policy.tensors["embed.W_o"].astype(float)  # (D, K)

    def affine(name: str, x: np.ndarray) -> np.ndarray:
        return policy.tensors[f"{name}.W"] @ x + policy.tensors[f"{name}.b"][:, 0]

    def norm(name: str, x: np.ndarray) -> np.ndarray:
        x_hat = (x - x.mean()) / np.sqrt(x.var() + 1e-5)
        return policy.tensors[f"{name}.gain"][:, 0] * x_hat + policy.tensors[f"{name}.shift"][:, 0]

    def attend(x: np.ndarray) -> np.ndarray:
        def project(name: str, x: np.ndarray) -> np.ndarray:  # (D, n) -> (heads, D / heads, n)
            W, b = (policy.tensors[f"attention.in.{part}{name}"] for part in "Wb")
            return (W @ x + b).reshape(numbers["heads"], -1, x.shape[1])
        q, k, v = project("q", x[:, None]), project("k", W_o), project("v", W_o)
        alpha = _softmax((q * k).sum(axis=1) / np.sqrt(q.shape[1]))  # (heads, K)
        y = norm("block.ln2", x + affine("attention.out", np.einsum("hk,hdk->hd", alpha, v).ravel()))
        y = norm("block.ln3", y + affine("block.ffn.1", _relu(affine("block.ffn.0", y))))
        return norm("block.ln_final", y)

    if init:
        z = affine("init.1", _relu(affine("init.0", s)))
        z = _relu(z) if policy.config["switches"]["o2v_init_relu"] == "released" else z
    elif "query.W" in policy.tensors:  # one token, of state and option
        z = affine("logits", attend(norm("query.ln", _relu(affine("query", _join(s, W_o, o_prev))))))
    else:  # two
        tokens = norm("state.ln", _relu(affine("state", s))), W_o[:, o_prev]
        z = affine("logits", np.concatenate([attend(token) for token in tokens]))

    h = _relu(affine("action.body.1", _relu(affine("action.body.0", _join(s, W_o, o)))))
    return _softmax(z), np.tanh(affine("action.mu", h)), np.logaddexp(0, affine("action.sigma", h))


def act(policy: Policy, s: np.ndarray, o_prev: int, init: bool, rng: np.random.Generator,
        mean: bool = False) -> tuple[int, np.ndarray]:
    """Draws an option o and an action a (A), with `mean` the mean action; s (S) normalised. The
    tasks clip a to their control range."""
    P, _, _ = forward(policy, s, o_prev, init, 0)
    o = int(rng.choice(len(P), p=P))
    _, mu, sigma = forward(policy, s, o_prev, init, o)
    return o, mu if mean else rng.normal(mu, sigma)


def _join(s: np.ndarray, W_o: np.ndarray, o: int) -> np.ndarray:
    return np.concatenate([s, W_o[:, o]])


def _relu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, 0)


def _softmax(z: np.ndarray) -> np.ndarray:
    """Along the last axis."""
    e = np.exp(z - z.max(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)
