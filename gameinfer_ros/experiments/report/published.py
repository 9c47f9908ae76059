"""The published results.

L. Peters, D. Fridovich-Keil, C. J. Tomlin, and Z. N. Sunberg, "Inference-Based Strategy Alignment
for General-Sum Differential Games", AAMAS 2020.
"""

from gameinfer_ros.experiments.prediction.watching import INFERENCE
from gameinfer_ros.names.choices import BASELINE, MAP

#: Number of clusters of equilibria, by scenario.
CLUSTERS = {"two_player": 2, "three_player": 8}

#: Peak of the mean squared prediction error, in m^2, and its look-ahead, in s.
PREDICTION_PEAKS = {INFERENCE: (0.15, 6.0), BASELINE: (2.4, 4.6)}

#: Mean cost to each player over 200 runs, by scenario and planner.
MEAN_COSTS: dict[str, dict[str, tuple[int, ...]]] = {
    "three_player": {MAP: (691, 693, 687), BASELINE: (1272, 1028, 970)},
    "five_player_unicycle": {
        MAP: (1053, 928, 931, 909, 932),
        BASELINE: (1615, 1138, 1074, 1037, 1145),
    },
}
