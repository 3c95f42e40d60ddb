"""Hydra's launcher plug-in of snowrepro: hydra/launcher=local."""
