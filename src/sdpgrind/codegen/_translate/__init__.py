"""Translator from kernels to C99: types, values, expressions, views, statements, functions, text."""
