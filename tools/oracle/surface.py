"""A fine mesh of own making over the parts of a craft: welded within a part and material, split evenly, with finite elements of conduction."""

import numpy as np
from scipy import sparse

from . import gltf


class Surface:
    """Vertices, faces and what they belong to."""

    def __init__(self, parts: list[gltf.Part], max_edge: float, edges: dict[str, float] | None = None) -> None:
        places, faces, part_of, coarse = [], [], [], []
        first = origin = 0
        for number, part in enumerate(parts):
            corners, index = np.unique(np.round(part.triangles.reshape(-1, 3), 6), axis=0, return_inverse=True)
            triangles = index.reshape(-1, 3)
            owner = np.arange(len(triangles)) + origin
            origin += len(triangles)
            keep = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2]) & (triangles[:, 2] != triangles[:, 0])
            edge = (edges or {}).get(part.name, max_edge)
            corners, triangles, owner = _split(*_zipped(corners, triangles[keep], owner[keep], edge), edge)
            corners, index = np.unique(np.round(corners, 7), axis=0, return_inverse=True)
            triangles = index.ravel()[triangles]
            places.append(corners)
            faces.append(triangles + first)
            part_of.append(np.full(len(triangles), number))
            coarse.append(owner)
            first += len(corners)
        self.parts = parts
        self.vertices, self.faces = np.concatenate(places), np.concatenate(faces)
        self.part_of = np.concatenate(part_of)
        # Triangle of the model that each face lies in.
        self.coarse = np.concatenate(coarse)
        self.triangles = self.vertices[self.faces]
        self.normals = gltf.flat_normals(self.triangles)
        a, b, c = self.triangles.transpose(1, 0, 2)
        self.area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        # Takes values of faces, weighted with their area, to the mean around each vertex.
        count, rows = len(self.vertices), self.faces.ravel()
        weight = np.repeat(self.area / 3, 3)
        self.vertex_area = np.maximum(np.bincount(rows, weight, count), 1e-12)
        columns = np.repeat(np.arange(len(self.faces)), 3)
        self.to_vertices = sparse.csr_matrix((weight / self.vertex_area[rows], (rows, columns)), (count, len(self.faces)))
        self.of_corners = sparse.csr_matrix((np.full(len(rows), 1 / 3), (columns, rows)), (len(self.faces), count))
        self.vertex_part = np.zeros(count, int)
        self.vertex_part[rows] = np.repeat(self.part_of, 3)

    def conduction(self, of_faces: np.ndarray) -> sparse.csr_matrix:
        """Matrix of linear elements [W/K] for a conductivity times thickness [W/K] of each face."""
        rows, columns, values = [], [], []
        for corner in range(3):
            i, j, k = (self.faces[:, (corner + n) % 3] for n in range(3))
            to_j, to_k = self.vertices[j] - self.vertices[i], self.vertices[k] - self.vertices[i]
            # The cotangent at corner i belongs to the edge across it, from j to k.
            half = 0.5 * of_faces * (to_j * to_k).sum(1) / np.maximum(np.linalg.norm(np.cross(to_j, to_k), axis=1), 1e-15)
            rows += [j, k, j, k]
            columns += [k, j, j, k]
            values += [-half, -half, half, half]
        count = len(self.vertices)
        return sparse.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (count, count))

    def at(self, seen_triangle: np.ndarray, place: np.ndarray, of_vertices: np.ndarray) -> np.ndarray:
        """Values at places on given faces, linear between their vertices."""
        a, b, c = self.triangles[seen_triangle].transpose(1, 0, 2)
        full = np.cross(b - a, c - a)
        norm = (full * full).sum(1)
        second = (np.cross(place - a, c - a) * full).sum(1) / norm
        third = (np.cross(b - a, place - a) * full).sum(1) / norm
        values = of_vertices[self.faces[seen_triangle]]
        return values[:, 0] * (1 - second - third) + values[:, 1] * second + values[:, 2] * third


def _zipped(vertices: np.ndarray, faces: np.ndarray, owner: np.ndarray, max_edge: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Divides needles, faces with one short edge and two that are far too long, across at once: halving them again and again would make many more."""
    vertices, made, of, rest = list(vertices), [], [], []
    for face, which in zip(faces, owner, strict=True):
        lengths = np.array([np.linalg.norm(vertices[face[(n + 1) % 3]] - vertices[face[n]]) for n in range(3)])
        short = int(lengths.argmin())
        others = np.delete(lengths, short)
        if lengths[short] > max_edge or others.min() <= 2 * max_edge:
            rest.append((face, which))
            continue
        # The tip lies across the short edge from `first` to `second`.
        first, second, tip = face[short], face[(short + 1) % 3], face[(short + 2) % 3]
        rails = []
        for end in (first, second):
            # Halves of halves, as neighbours split the same edge.
            pieces = 1 << int(np.ceil(np.log2(np.linalg.norm(vertices[tip] - vertices[end]) / max_edge)))
            rail = [tip]
            for n in range(1, pieces):
                vertices.append(vertices[tip] + (vertices[end] - vertices[tip]) * (n / pieces))
                rail.append(len(vertices) - 1)
            rails.append([*rail, end])
        i = j = 1
        one, two = rails
        made.append([tip, one[1], two[1]])
        of.append(which)
        while i < len(one) - 1 or j < len(two) - 1:
            if j == len(two) - 1 or (i < len(one) - 1 and (i + 1) / (len(one) - 1) <= (j + 1) / (len(two) - 1)):
                made.append([one[i], one[i + 1], two[j]])
                i += 1
            else:
                made.append([one[i], two[j + 1], two[j]])
                j += 1
            of.append(which)
    made += [face for face, _ in rest]
    of += [which for _, which in rest]
    return np.array(vertices), np.array(made), np.array(of)


def _split(vertices: np.ndarray, faces: np.ndarray, owner: np.ndarray, max_edge: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Splits all edges beyond a length at their middles until none is left. Faces that share an edge split it alike."""
    while True:
        pairs = np.sort(np.stack([faces, np.roll(faces, -1, 1)], 2).reshape(-1, 2), 1)
        edges, index = np.unique(pairs, axis=0, return_inverse=True)
        length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
        too_long = length > max_edge
        if not too_long.any():
            return vertices, faces, owner
        middle = np.full(len(edges), -1)
        middle[too_long] = len(vertices) + np.arange(too_long.sum())
        vertices = np.concatenate([vertices, 0.5 * (vertices[edges[too_long, 0]] + vertices[edges[too_long, 1]])])
        middle = middle[index.ravel()].reshape(-1, 3)
        made, of = [], []
        for mask in range(8):
            those = np.flatnonzero(((middle >= 0) @ [1, 2, 4]) == mask)
            if not len(those):
                continue
            a, b, c = faces[those].T
            x, y, z = middle[those].T  # on ab, bc, ca
            pieces = {
                0: [(a, b, c)],
                1: [(a, x, c), (x, b, c)],
                2: [(a, b, y), (a, y, c)],
                4: [(a, b, z), (z, b, c)],
                3: [(a, x, c), (x, b, y), (x, y, c)],
                6: [(a, b, z), (b, y, z), (y, c, z)],
                5: [(a, x, z), (x, b, z), (z, b, c)],
                7: [(a, x, z), (x, b, y), (z, y, c), (x, y, z)],
            }[mask]
            made += [np.column_stack(piece) for piece in pieces]
            of += [owner[those]] * len(pieces)
        faces, owner = np.concatenate(made), np.concatenate(of)
