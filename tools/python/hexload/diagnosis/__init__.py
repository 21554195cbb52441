"""Names the cause of a mismatch: what a whole log says against itself and against the rigid body on its six legs.

In the order of the data flow: record (the log on an even grid) -> channels (each sensor by itself) -> kinematics
(velocities against displacements) -> dynamics (forces against the motion, the load free) with causes (the columns of each
fault) and bank (which of them explain the residual) -> wiring (forces and legs exchanged) -> diagnose (one ranked list,
in words). Needs numpy alone; no estimator takes part, so the words are those of every estimator's replay.
"""
