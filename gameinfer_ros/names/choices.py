"""Names of the choices that users make."""

#: Planners: align with the most likely equilibrium, or follow one drawn at random.
MAP, BASELINE = "map", "baseline"

#: Time modes: each step waits for the inputs of all players, or steps follow the clock.
LOCKSTEP, REALTIME = "lockstep", "realtime"

#: Where the runs of a study execute: processes on this machine, or workers of a Dask cluster.
PROCESSES, DASK = "processes", "dask"
