# SPDX-License-Identifier: BSD-3-Clause
"""Calls a service of a node with raw bytes."""
import io
import socket
import struct

import rosgraph
import rospy
import rosservice


def to_bytes(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


class RawService:
    def __init__(self, name, patience_s):
        """@param patience_s  Silence of the node after which socket.timeout is raised."""
        self.name = name
        self.patience_s = patience_s
        self.type = rosservice.get_service_class_by_name(name)
        self.address = rosgraph.Master(rospy.get_name()).lookupService(name)[len('rosrpc://'):].split(':')

    def call(self, request):
        """@return 'answer', 'refused' or 'closed'; and the received bytes for the first two."""
        fields = [f'callerid={rospy.get_name()}', f'service={self.name}', 'md5sum=*',
                  'persistent=0']
        header = b''.join(struct.pack('<I', len(field)) + field.encode() for field in fields)
        with socket.create_connection((self.address[0], int(self.address[1])), self.patience_s) as link, \
                link.makefile('rb') as stream:
            link.sendall(struct.pack('<I', len(header)) + header)
            self.receive(stream)
            link.sendall(struct.pack('<I', len(request)) + request)
            how = {b'\x01': 'answer', b'\x00': 'refused'}.get(stream.read(1), 'closed')
            return how, b'' if how == 'closed' else self.receive(stream)

    @staticmethod
    def receive(stream):
        size = struct.unpack('<I', RawService.read(stream, 4))[0]
        return RawService.read(stream, size)

    @staticmethod
    def read(stream, size):
        data = stream.read(size)
        if len(data) < size:
            raise ConnectionError('the node has closed the connection')
        return data
