"""The process that serves: server, workers, kernels."""
