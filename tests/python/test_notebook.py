# SPDX-License-Identifier: BSD-3-Clause
"""The output in a notebook; a real notebook if Debian's python3-nbclient and python3-ipykernel are installed."""

import pytest

import carom
from scenes import five_springs


def test_a_simulation_and_a_run_as_tables(tmp_path):
    sim = five_springs()
    sim.title = "a < b"
    html = sim._repr_html_()
    assert "a &lt; b" in html and "harmonic-bond" in html and "5 in 2 dimensions" in html and "<td style='text-align: left'>none</td>" in html
    sim.output(tmp_path / "run", thermo_interval=0.5)
    during = []
    sim.run(time=2, callback=lambda s: during.append(s._repr_html_()))
    assert "time</th><td style='text-align: left'>1, step 100<" in during[2] and f"<td style='text-align: left'>{tmp_path / 'run'}<" in sim._repr_html_()
    shown = sim.open()._repr_html_()
    assert "status</th><td style='text-align: left'>done<" in shown and "edda" in shown
    assert "time" in carom.Simulation(box=[2, 2])._repr_html_()


def test_a_notebook_has_a_bar_of_progress(tmp_path, monkeypatch):
    pytest.importorskip("ipykernel")
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    cells = ["import sys; sys.path.insert(0, 'tests'); import carom.progress, time; from scenes import five_springs; carom.progress.QUIET = 0",
             "s = five_springs(); s.run(time=3, every=0.5, callback=lambda s: time.sleep(0.06))", "s"]
    cells[0] = cells[0].replace("'tests'", repr(str(__import__("pathlib").Path(__file__).parent)))
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    changes = []
    client = nbclient.NotebookClient(notebook, timeout=1200, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}})
    real = client.process_message
    monkeypatch.setattr(client, "process_message", lambda message, *more: (changes.append(message), real(message, *more))[1])
    client.execute()
    bars = [m["content"]["data"]["text/html"] for m in changes if m["msg_type"] in ("display_data", "update_display_data")]
    assert sum("<progress" in bar for bar in bars) > 2 and bars[-1] == ""
    assert "5 in 2 dimensions" in notebook.cells[2].outputs[0]["data"]["text/html"]
