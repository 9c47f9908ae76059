"""What there is to choose from, by the names that users know."""

#: Planners: align with the most likely equilibrium, or stick to one drawn at random.
MAP, BASELINE = "map", "baseline"

#: Time: every step waits for all who take part in it, or nobody waits for anybody.
LOCKSTEP, REALTIME = "lockstep", "realtime"

#: Where the runs of a study are made: here, or on the workers of a Dask cluster.
PROCESSES, DASK = "processes", "dask"
