"""The face, `import freelearn as fl`: what each function does, and what it gives."""
