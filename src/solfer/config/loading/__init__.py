"""Steps from the files to a plugin's configuration, each in a module of its own.

`layers` merges the files; `library` reads pipes and calibrations by name; `configuration` is what comes out, and
`effective` writes it as YAML; `load` reads one module, `shared` those of a shared plugin, `rt_layer` those of an RT
layer, `check` all.
"""
