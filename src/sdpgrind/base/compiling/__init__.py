"""Compiling of kernels: the decorator, machine code on disk, digests, progress, compiling ahead of use."""
