"""F, dF/dx and all of dF/dq of 250 smooth-min blobs (m = 1000) with JAX: jit(vmap(grad)), f64, one thread."""

import os

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import json
import time

import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)

K = 8.0
POINTS = 16_384


def smooth_min(x, q):
    """F at one point x (3,) for q (250, 4): centre and radius a row."""
    offset = x - q[:, :3]
    distance = jnp.sqrt(jnp.sum(offset * offset, axis=1))
    return -jnp.log(jnp.sum(jnp.exp(-K * (distance - q[:, 3])))) / K


def main(runs: int = 5) -> dict:
    """Microseconds a point, the best of several batch sizes, compilation left out."""
    rng = np.random.default_rng(1)
    q = np.column_stack([rng.uniform(-1, 1, (250, 3)), rng.uniform(0.1, 0.3, 250)])
    points = rng.uniform(-1.2, 1.2, (POINTS, 3))
    evaluate = jax.jit(jax.vmap(jax.value_and_grad(smooth_min, argnums=(0, 1)), in_axes=(0, None)))
    by_batch = {}
    for batch in (64, 256, 1024, 4096):
        chunks = [jnp.asarray(points[i : i + batch]) for i in range(0, POINTS, batch)]
        parameters = jnp.asarray(q)
        jax.block_until_ready(evaluate(chunks[0], parameters))
        times = []
        for _ in range(runs):
            start = time.perf_counter()
            for chunk in chunks:
                jax.block_until_ready(evaluate(chunk, parameters))
            times.append(time.perf_counter() - start)
        by_batch[batch] = 1e6 * min(times) / POINTS
    batch = min(by_batch, key=by_batch.__getitem__)
    return {"jax": jax.__version__, "us_per_point": by_batch[batch], "batch": batch, "by_batch": by_batch}


if __name__ == "__main__":
    print(json.dumps(main()))
