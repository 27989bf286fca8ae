"""
# The paper's comparison

Three models of one robot, identified from the same noise-free log. This notebook runs from top to bottom in a minute.
It needs idbench and, for the last cell, rerun's notebook viewer (`uv pip install "rerun-sdk[notebook]"`).
"""

from idbench.experiments.paper.table1 import CHAINS_COMPARED, SCENARIO, Table1
from idbench.sim.scenario.scenario_file import load

table = Table1(load(SCENARIO), CHAINS_COMPARED)
log = table.log
print(f"{log.samples} samples of {log.n} joints at {log.fs:g} Hz")

"""
## The same motion, three models, three chains

A *chain* is what turns the log into rows: filters, differences, masks. `paper` takes the paper's steps as printed.
`paper_masked` leaves out what lies near reversals. `idbench` is ours.
"""

import numpy as np

truth = np.array(list(table.truth.values()))
print(f"{'':10}" + "".join(f"{chain:>28}" for chain in table.estimates))
for form in ("explicit", "implicit", "power"):
    worst = [estimates[form].relative_error_percent(truth).max() for estimates in table.estimates.values()]
    print(f"{form:10}" + "".join(f"{error:22.2g} % off" for error in worst))

"""
Explicit and implicit agree. The power model does as well on clean data, with a condition number three times as large.
That number is what noise will be multiplied by.
"""

for form, estimate in table.estimates["idbench"].items():
    print(f"{form:10} Cond(W) = {estimate.condition_number:6.1f}, {estimate.row_count} rows")

"""
## Now with an encoder

A 14-bit encoder counts. Its counts are differentiated twice, and that noise reaches every row.
GLS knows how it grows with frequency; ordinary least squares (OLS) does not.
"""

from idbench.identify import ESTIMATORS, MODELS, MotionLog, identify, scara

step = 2 * np.pi / 2**14
counted = MotionLog(log.fs, np.round(log.q / step) * step, log.tau, log.torque)
for name in ("OLS", "WLS", "GLS"):
    for form in ("explicit", "power"):
        found = identify(counted, scara(), MODELS.create(form), estimator=ESTIMATORS.create(name))
        typical = np.exp(np.mean(np.log(found.relative_error_percent(truth))))
        print(f"{name} {form:9} typical error {typical:7.3f} %")

"""
## Look at it

A recording shows where measured and predicted torque part. In a notebook rerun shows it below the cell;
on the command line `idbench table1` and `idbench view` do the same.
"""

from pathlib import Path

from idbench.experiments.recording.notebook import notebook_viewer
from idbench.experiments.recording.comparison_recording import record_table1
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.attempts import write_streams

folder = ResultsFolder(Path("comparison"), "table1", command="notebook comparison")
with folder.held():
    write_streams(record_table1(table), folder)
notebook_viewer(folder.out)
