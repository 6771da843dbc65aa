//! Several solvers and guesses on one scene.
