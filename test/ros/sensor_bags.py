# SPDX-License-Identifier: BSD-3-Clause
"""Small messages of sensors and of tf, and bags of them."""
import math
import struct
import zlib

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, LaserScan, PointCloud2, PointField
from tf2_msgs.msg import TFMessage

START_S = 1600000000
KINDS = {'<f4': PointField.FLOAT32, '<f8': PointField.FLOAT64, '<u4': PointField.UINT32}


def at(time_s):
    return rospy.Time.from_sec(START_S + time_s)


def make_cloud(points, time_s=1.0, frame='lidar', kind='<f4', times_ns=None, times=None, **description):
    """A cloud in one row. times: name, type and values of their field; further arguments are fields of the message,
    such as height."""
    times = times or (('t', '<u4', times_ns) if times_ns is not None else None)
    points = np.asarray(points, float).reshape(-1, 3)
    columns = [(axis, kind) for axis in 'xyz'] + ([times[:2]] if times else [])
    rows = np.zeros(len(points), columns)
    for axis, values in zip('xyz', points.T):
        rows[axis] = values
    if times:
        rows[times[0]] = times[2]
    cloud = PointCloud2(width=len(rows), height=1, point_step=rows.itemsize, row_step=rows.nbytes, data=rows.tobytes())
    cloud.fields = [PointField(name, rows.dtype.fields[name][1], KINDS[of], 1) for name, of in columns]
    cloud.header.frame_id, cloud.header.stamp = frame, at(time_s)
    for name, value in description.items():
        setattr(cloud, name, value)
    return cloud


def make_scan(ranges, time_s=1.0, frame='lidar', range_max=10.0):
    step = 2.0 * math.pi / len(ranges)
    scan = LaserScan(angle_min=-math.pi, angle_max=math.pi - step, angle_increment=step, range_min=0.1,
                     range_max=range_max, ranges=ranges)
    scan.header.frame_id, scan.header.stamp = frame, at(time_s)
    return scan


def make_depth(depths, time_s=1.0, frame='lidar'):
    depths = np.asarray(depths)
    image = Image(height=depths.shape[0], width=depths.shape[1], step=depths.shape[1] * depths.itemsize,
                  encoding='16UC1' if depths.dtype == np.uint16 else '32FC1', data=depths.tobytes())
    image.header.frame_id, image.header.stamp = frame, at(time_s)
    return image


def write_png(numbers):
    """A PNG with 16 bits of grey, as OpenCV writes it: without gAMA."""
    def chunk(name, data):
        return struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))
    height, width = numbers.shape
    rows = b''.join(b'\0' + row.astype('>u2').tobytes() for row in numbers)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 16, 0, 0, 0, 0)) +
            chunk(b'IDAT', zlib.compress(rows)) + chunk(b'IEND', b''))


def compress_depth(image, transport='compressedDepth'):
    """Compresses a depth image as image_transport_plugins do: 32FC1 as inverse depths to 10 m, quantization 100."""
    kind = np.uint16 if image.encoding == '16UC1' else np.float32
    numbers = np.frombuffer(image.data, kind).reshape(image.height, image.width)
    header = struct.pack('<iff', 0, 0.0, 0.0)
    if kind is np.float32:
        quant_a = 100.0 * 101.0
        quant_b = 1.0 - quant_a / 10.0
        header = struct.pack('<iff', 0, quant_a, quant_b)
        numbers = np.where(numbers < 10.0, quant_a / numbers + quant_b, 0.0).astype(np.uint16)
    message = CompressedImage(format=image.encoding + '; compressedDepth png', data=header + write_png(numbers))
    if transport == 'compressed':
        message.format, message.data = image.encoding + '; png compressed ', write_png(numbers)
    message.header = image.header
    return message


def make_camera(width, height, focal_length, time_s=1.0, frame='lidar'):
    f, cx, cy = focal_length, (width - 1) / 2.0, (height - 1) / 2.0
    camera = CameraInfo(width=width, height=height, K=[f, 0, cx, 0, f, cy, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                        P=[f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0])
    camera.header.frame_id, camera.header.stamp = frame, at(time_s)
    return camera


def make_tf(parent, child, time_s=0.0, position=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0)):
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id, transform.header.stamp = parent, child, at(time_s)
    to, turn = transform.transform.translation, transform.transform.rotation
    to.x, to.y, to.z = position
    turn.x, turn.y, turn.z, turn.w = rotation
    return TFMessage([transform])


def write_bag(file, records, **options):
    """records: (topic, message, time of recording in seconds after the start)."""
    with rosbag.Bag(file, 'w', **options) as bag:
        for topic, message, time_s in records:
            bag.write(topic, message, at(time_s))
