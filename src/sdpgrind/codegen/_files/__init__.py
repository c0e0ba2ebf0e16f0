"""Files of an export: header, source, self-test, vectors, manifest, written whole."""
