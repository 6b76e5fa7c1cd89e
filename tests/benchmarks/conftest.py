"""Save statistics, processor and libraries with the benchmarks, without every single time."""

from typing import Any

from pdrom.core.machine import machine


def pytest_benchmark_update_json(
    config: Any, benchmarks: list[Any], output_json: dict[str, Any]
) -> None:
    """Shorten the file that `--benchmark-json` writes."""
    for benchmark in output_json["benchmarks"]:
        benchmark["stats"].pop("data", None)
        for key, value in benchmark["stats"].items():
            if isinstance(value, float):
                benchmark["stats"][key] = float(f"{value:.4g}")
        benchmark["options"] = {}


def pytest_benchmark_update_machine_info(config: Any, machine_info: dict[str, Any]) -> None:
    """Replace the record of the machine by that of the study."""
    machine_info.clear()
    machine_info.update(machine().model_dump(mode="json"))


def pytest_benchmark_update_commit_info(config: Any, commit_info: dict[str, Any]) -> None:
    """The commit is in the record of the machine."""
    for key in list(commit_info):
        if key not in ("id", "dirty"):
            del commit_info[key]
