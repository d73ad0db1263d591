"""`python -m anim`: the command `gltf-anim`."""

from cli.main import main

if __name__ == "__main__":
    main()
