"""The clusters, started once for all tests of a process, and what a test needs to use one."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cluster.clusters import RAY_LOOPBACK, ray_cluster, slurm_cluster, slurm_lacks

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Cluster:
    """``overrides`` that send a sweep there; ``env`` for the command that does."""

    kind: str
    overrides: tuple[str, ...]
    env: dict[str, str]


@pytest.fixture(scope="session")
def slurm() -> Iterator[Cluster]:
    """Slurm with one node of two processors."""
    lacking = slurm_lacks()
    if lacking:
        pytest.skip(lacking)
    with slurm_cluster() as env:
        yield Cluster("slurm", ("hydra/launcher=slurm", "hydra.launcher.mem_gb=1"), env)


@pytest.fixture(scope="session")
def ray() -> Iterator[Cluster]:
    """Ray with two nodes of one processor each."""
    pytest.importorskip("hydra_plugins.hydra_ray_launcher", reason="pip install 'snowrepro[ray]'")
    pytest.importorskip("ray", reason="pip install 'snowrepro[ray]'")
    if sys.platform != "linux":
        pytest.skip(f"Ray's two nodes listen on {RAY_LOOPBACK}, which Linux alone has from the start")
    with ray_cluster(str(ROOT)) as (address, env):
        init = "hydra.launcher.ray.init"
        overrides = (f"{init}.address={address}", f"+{init}._node_ip_address={RAY_LOOPBACK}")
        yield Cluster("ray", ("hydra/launcher=ray", *overrides), env)


@pytest.fixture(params=["slurm", "ray"])
def cluster(request: pytest.FixtureRequest) -> Cluster:
    """Each of the two."""
    return request.getfixturevalue(request.param)
