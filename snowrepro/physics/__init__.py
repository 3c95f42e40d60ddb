"""The paper's laws at one material point: pure Taichi functions, Eqs. 1 to 9."""
