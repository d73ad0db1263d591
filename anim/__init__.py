"""glTF 2.0 animation as immutable values and pure functions: the library under the `gltf-anim` command."""

__version__ = "0.1.0"
