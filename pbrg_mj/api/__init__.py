"""The Python API: what `import pbrg_mj` offers, and what the command line is written on."""
