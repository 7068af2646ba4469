# SPDX-License-Identifier: BSD-3-Clause
"""Draws axis-aligned boxes in perspective, opaque and translucent ones, for scripts/make_pictures."""
import numpy as np
from PIL import Image

FACE_LIGHT = np.array([0.78, 0.9, 1.0])  # Of faces across x, y and z.


class Camera:
    """Looks from one point at another, z up. Lengths in metres."""

    def __init__(self, eye, look_at, angle_deg, width, height):
        self.eye, self.width, self.height = np.asarray(eye, float), width, height
        forward = np.asarray(look_at, float) - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        self.axes = np.array([right, np.cross(right, forward), forward])
        self.scale = height / 2 / np.tan(np.radians(angle_deg) / 2)

    def rays(self, columns, rows):
        """Directions through the middles of pixels, (rows, columns, 3), with length 1 along the view."""
        x, y = np.meshgrid((columns + 0.5 - self.width / 2) / self.scale, (self.height / 2 - rows - 0.5) / self.scale)
        return x[..., None] * self.axes[0] + y[..., None] * self.axes[1] + self.axes[2]

    def project(self, points):
        """Pixels of points, (n, 2), and their depths."""
        seen = (np.asarray(points, float) - self.eye) @ self.axes.T
        depth = seen[:, 2]
        safe = np.maximum(depth, 1e-6)
        return np.stack([self.width / 2 + seen[:, 0] / safe * self.scale, self.height / 2 - seen[:, 1] / safe * self.scale], 1), depth


class Drawing:
    """Pixels with depths. Boxes are (n, 6): min x, y, z, max x, y, z."""

    def __init__(self, camera, background=(255, 255, 255)):
        self.camera = camera
        self.color = np.tile(np.array(background, float), (camera.height, camera.width, 1))
        self.depth = np.full((camera.height, camera.width), np.inf)

    def _hits(self, box):
        """Where rays meet the box: the part of the picture, depth, face, and distance to the face's border."""
        camera = self.camera
        corners = np.array([[box[3 * (i >> axis & 1) + axis] for axis in range(3)] for i in range(8)])
        pixels, depths = camera.project(corners)
        if (depths < 0.05).any():
            return None
        low, high = np.floor(pixels.min(0)).astype(int), np.ceil(pixels.max(0)).astype(int) + 1
        columns, rows = (np.arange(max(0, low[axis]), min(size, high[axis])) for axis, size in ((0, camera.width), (1, camera.height)))
        if not len(columns) or not len(rows):
            return None
        directions = camera.rays(columns, rows)
        with np.errstate(divide='ignore', invalid='ignore'):
            ends = [(np.asarray(box[3 * side:3 * side + 3]) - camera.eye) / directions for side in (0, 1)]
        enter, leave = np.minimum(*ends), np.maximum(*ends)
        depth, face = enter.max(-1), enter.argmax(-1)
        hit = (depth < leave.min(-1)) & (depth > 0)
        places = camera.eye + directions * depth[..., None]
        borders = np.minimum(places - box[:3], np.asarray(box[3:]) - places)
        np.put_along_axis(borders, face[..., None], np.inf, -1)
        return np.ix_(rows, columns), depth, face, borders.min(-1), hit

    def add(self, boxes, colors, edge_px=0.0):
        """Opaque boxes; `colors` is one or (n, 3). Edges are darker, `edge_px` wide."""
        colors = np.broadcast_to(np.asarray(colors, float), (len(boxes), 3))
        for box, color in zip(boxes, colors):
            hits = self._hits(box)
            if hits is None:
                continue
            part, depth, face, border, hit = hits
            nearer = hit & (depth < self.depth[part])
            light = FACE_LIGHT[face] * np.where(border < edge_px * depth / self.camera.scale, 0.45, 1.0)
            self.color[part] = np.where(nearer[..., None], color * light[..., None], self.color[part])
            self.depth[part] = np.where(nearer, depth, self.depth[part])

    def add_translucent(self, boxes, color, alpha, edge_px=1.5):
        """Boxes that let what is behind shine through, the farthest first."""
        order = sorted(boxes, key=lambda box: -np.linalg.norm((np.asarray(box[:3]) + box[3:]) / 2 - self.camera.eye))
        for box in order:
            hits = self._hits(box)
            if hits is None:
                continue
            part, depth, face, border, hit = hits
            share = np.where(border < edge_px * depth / self.camera.scale, 0.9, alpha * FACE_LIGHT[face])
            share = np.where(hit & (depth < self.depth[part] + 1e-3), share, 0.0)[..., None]
            self.color[part] = self.color[part] * (1 - share) + np.asarray(color, float) * share

    def add_line(self, points, color, width_px):
        """A line from point to point, in front of everything."""
        from PIL import ImageDraw
        picture = Image.fromarray(self.color.round().astype(np.uint8))
        pixels = [tuple(pixel) for pixel in self.camera.project(points)[0]]
        ImageDraw.Draw(picture).line(pixels, tuple(color), int(width_px), 'curve')
        for end in (pixels[0], pixels[-1]):
            radius = 2 * width_px
            ImageDraw.Draw(picture).ellipse([end[0] - radius, end[1] - radius, end[0] + radius, end[1] + radius], tuple(color))
        self.color = np.asarray(picture, float)

    def picture(self, smooth=2):
        """The picture, `smooth` times smaller than what was drawn."""
        picture = Image.fromarray(self.color.round().astype(np.uint8))
        return picture.resize((self.camera.width // smooth, self.camera.height // smooth), Image.LANCZOS)


def height_colors(boxes, low, high):
    """Blue at the height `low` to red at `high`, of the middles of boxes."""
    share = np.clip(((boxes[:, 2] + boxes[:, 5]) / 2 - low) / (high - low), 0, 1)
    stops = np.array([(58, 90, 190), (70, 170, 200), (110, 190, 100), (235, 190, 70), (205, 75, 55)], float)
    place = share * (len(stops) - 1)
    lower = np.minimum(place.astype(int), len(stops) - 2)
    return stops[lower] + (stops[lower + 1] - stops[lower]) * (place - lower)[:, None]
