"""Threads, spawned processes and dask: the same bits for any number of workers."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from executor_problems import belief, dulling, line
from sdp_inside import Bundles, Grid

from sdpgrind import sdp, weldbead

START = {"height": 1.0, "time_left": 4.0}
RUNS = 70_000
"""More than two blocks of Monte-Carlo."""


def cases():
    presets = {name: weldbead.preset(name) for name in ("P1", "P5")}
    return {name: problem.replace(horizon=16.0) for name, problem in presets.items()}


def everything(executor):
    """Arrays of a 2-D solve with and without end, a Monte-Carlo and a sweep on an executor."""
    two = sdp.plan(dulling(), executor=executor)
    ever = sdp.plan(belief(), executor=executor)
    runs = sdp.plan(line()).simulate(runs=RUNS, rng=7, executor=executor, **START)
    sweep = weldbead.sequence.sweep(
        cases(), height=1.0, time_left=[6.0, 16.0], tolerance=1e-2, executor=executor
    )
    tables = [
        getattr(p.table, name) for p in (two, ever) for name in ("value", "best", "control", "entry", "gap")
    ]
    return [
        *tables,
        runs.penalty,
        runs.moves,
        *runs.final.values(),
        *(np.asarray(sweep[name]) for name in sorted(sweep)),
    ]


@pytest.fixture(scope="module")
def serial():
    return everything(None)


def assert_same_bits(found, expected):
    assert len(found) == len(expected)
    for a, b in zip(found, expected, strict=True):
        assert a.dtype == b.dtype and a.tobytes() == b.tobytes()


def test_there_is_more_than_one_block_of_each_kind():
    for problem in (dulling(), belief()):
        groups = Bundles(problem, Grid.of(problem))._groups
        assert max(len(pieces) for _, pieces in groups) > 1


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_threads(serial, workers):
    with ThreadPoolExecutor(workers) as executor:
        assert_same_bits(everything(executor), serial)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2])
def test_spawned_processes(serial, workers):
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as executor:
        assert_same_bits(everything(executor), serial)


@pytest.mark.slow
def test_dask(serial):
    """Two blocks at a time, sent over sockets within this process: another would import all once more."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=2,
            processes=False,
            protocol="tcp://",
            dashboard_address="127.0.0.1:0",
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert_same_bits(everything(client.get_executor()), serial)


def test_a_callback_that_does_not_pickle_says_so():
    problem = dulling()
    bad = sdp.Move("dress", {}, sdp.Sampled(lambda s, c, e: (s.height, 0.0 * s.dull)))
    problem = sdp.Problem(problem.axes, [problem.moves[0], bad], problem.stops, problem.stages)
    with ThreadPoolExecutor(1) as executor, pytest.raises(Exception, match=r"pickle|lambda"):
        sdp.plan(problem, executor=executor)


def test_the_seed_decides_and_nothing_else():
    policy = sdp.plan(line())
    one, two = (policy.simulate(runs=5000, rng=seed, **START).penalty for seed in (1, 2))
    again = policy.simulate(runs=5000, rng=np.random.default_rng(1), **START).penalty
    assert np.array_equal(one, again) and not np.array_equal(one, two)
