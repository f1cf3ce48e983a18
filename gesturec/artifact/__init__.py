"""The compiled model: its tables, its file, and the kinematics that compiler and runtime share.

Needs numpy and the standard library alone. `Artifact` is the product; `columns` declares its arrays,
`manifest` its names; `store` reads and writes `.gcm` files, `validate` is why they can be trusted.
"""
