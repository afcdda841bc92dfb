"""Manifests: valid by the schemas, consistent with the service, and with the least rights."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.serving import GRACE
from service.settings import Settings

DEPLOY = Path(__file__).parents[2] / "deploy"
KUBERNETES = DEPLOY / "kubernetes"
REPLICAS = DEPLOY / "replicas"
LAST = 5.0 + GRACE  # s of a service's end, with the longest draining
SERVICE_BYTES = 661_000_000  # of all its processes, at most, while others send the largest maps and scans
KIND_FILES = {
    "Deployment": "deployment.yaml",
    "Service": "service.yaml",
    "HorizontalPodAutoscaler": "autoscaler.yaml",
    "PodDisruptionBudget": "disruptions.yaml",
    "NetworkPolicy": "network.yaml",
}


def manifest(kind: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((KUBERNETES / KIND_FILES[kind]).read_text())
    assert found["kind"] == kind
    return found


def compose() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((REPLICAS / "compose.yaml").read_text())
    return found


@pytest.fixture
def built() -> list[dict[str, Any]]:
    """The manifests as kustomize puts them together."""
    kubectl = shutil.which("kubectl")
    if kubectl is None:
        pytest.skip("no kubectl")
    ended = subprocess.run([kubectl, "kustomize", str(KUBERNETES)], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    return list(yaml.safe_load_all(ended.stdout))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("version", ["1.30", "1.37"])
def test_manifests_are_valid(built: list[dict[str, Any]], version: str) -> None:
    validator = pytest.importorskip("kubernetes_validate")
    assert sorted(one["kind"] for one in built) == sorted(KIND_FILES)
    for one in built:
        validator.validate(one, version, strict=True)
    spoiled = manifest("Service")
    spoiled["spec"]["ports"][0]["prot"] = 1
    with pytest.raises(validator.ValidationError):
        validator.validate(spoiled, version, strict=True)


def test_selectors_find_the_pods(built: list[dict[str, Any]]) -> None:
    by_kind = {one["kind"]: one for one in built}
    labels = by_kind["Deployment"]["spec"]["template"]["metadata"]["labels"]
    for kind, path in (("Service", "selector"), ("PodDisruptionBudget", "selector"), ("NetworkPolicy", "podSelector")):
        selector = by_kind[kind]["spec"][path]
        assert selector.get("matchLabels", selector).items() <= labels.items()
    assert (
        by_kind["HorizontalPodAutoscaler"]["spec"]["scaleTargetRef"]["name"]
        == by_kind["Deployment"]["metadata"]["name"]
    )


def test_a_pod_has_no_right_that_it_does_not_need() -> None:
    pod = manifest("Deployment")["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    assert (pod["securityContext"]["runAsNonRoot"], pod["automountServiceAccountToken"]) == (True, False)
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }


def test_every_deployment_has_memory_for_two_imports_next_to_the_service() -> None:
    """Together beyond the limit, the system ends the service with all its searches, again and again."""
    container = manifest("Deployment")["spec"]["template"]["spec"]["containers"][0]
    limits = {
        container["resources"]["limits"]["memory"].removesuffix("Gi"),
        compose()["services"]["linefix"]["deploy"]["resources"]["limits"]["memory"].removesuffix("g"),
        yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["linefix"]["mem_limit"].removesuffix("g"),
        *re.findall(r"^MemoryMax=(\d+)G$", (DEPLOY / "linefix.service").read_text(), re.MULTILINE),
    }
    assert limits == {"3"}
    assert SERVICE_BYTES + 2 * Settings.model_fields["max_import_bytes"].default <= 3 * 2**30


def test_counts_are_for_the_monitoring_alone() -> None:
    """And HTTP for the proxy: a policy has no paths."""
    (rule,) = manifest("NetworkPolicy")["spec"]["ingress"]
    named = [one["namespaceSelector"]["matchLabels"]["kubernetes.io/metadata.name"] for one in rule["from"]]
    assert named == ["ingress-nginx", "monitoring"]


def test_a_pod_has_time_to_end() -> None:
    pod = manifest("Deployment")["spec"]["template"]["spec"]
    pause = float(pod["containers"][0]["lifecycle"]["preStop"]["exec"]["command"][1])
    assert pod["terminationGracePeriodSeconds"] > pause + LAST
    assert float(compose()["services"]["linefix"]["stop_grace_period"].rstrip("s")) > LAST


def test_settings_and_metrics_are_the_services() -> None:
    container = manifest("Deployment")["spec"]["template"]["spec"]["containers"][0]
    told = [one["name"] for one in container["env"]] + list(compose()["services"]["linefix"]["environment"])
    assert [name for name in told if name.removeprefix("LINEFIX_").lower() not in Settings.model_fields] == []
    probes = {container[f"{kind}Probe"]["httpGet"]["path"] for kind in ("startup", "liveness", "readiness")}
    assert probes == {"/livez", "/readyz"}
    metric = manifest("HorizontalPodAutoscaler")["spec"]["metrics"][0]["pods"]["metric"]["name"]
    read = [path.read_text() for path in (DEPLOY.parent / "service").rglob("*.py")]
    assert any(f'"{metric}"' in text for text in read)


def test_compose_file_is_valid() -> None:
    spec = pytest.importorskip("compose_spec")
    text = (REPLICAS / "compose.yaml").read_text()
    spec.PyCompose.from_yaml(text).validate()
    with pytest.raises(ValueError, match="replicas"):
        spec.PyCompose.from_yaml(text.replace("replicas: 3", "replicas: many"))
    services = compose()["services"]
    assert set(services) == {"linefix", "postgres", "nginx", "prometheus", "grafana"}
    mounted = [volume.split(":")[0] for service in services.values() for volume in service.get("volumes", [])]
    there = {*compose()["volumes"], "../../secrets/keys"}  # the latter is made by who runs it
    assert [one for one in mounted if one not in there and not (REPLICAS / one).exists()] == []
