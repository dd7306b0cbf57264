# SPDX-License-Identifier: Apache-2.0
"""Reads the contacts of a DART world (Debian's python3-dartpy)."""

import carillon
import numpy

# A striker of this mass changes the reduced mass of no real body, and one of this radius is flat.
FLOOR = {"mass_kg": 1e6, "radius_m": 1}


class DartContacts:
    """What a step of a stream or trace takes: `trace.step(time, **contacts.read(world))`. Open the stream or trace with
    frame="scene". `striker` is the substance of bodies without a sound, which count as immovable and flat.
    `roughness_depth` and `irregularity_length` (metres) let slides and rolls be heard, as carillon.Contacts says."""

    def __init__(self, *, striker="", roughness_depth=0.0, irregularity_length=0.0):
        self._settings = {"striker": carillon.striker(striker, **FLOOR),
                          "roughness_depth": roughness_depth, "irregularity_length": irregularity_length}
        self._objects = {}  # by the key of a body: the body, its handle, and its pose after the step before
        self._partners = {}
        self._partner_count = 0

    def add_object(self, body, handle):
        """Lets a BodyNode sound as the object with this handle; its frame must be that of its modal model."""
        self._objects[_key(body)] = [body, int(handle), _pose(body)]

    def remove_object(self, body):
        """Lets a BodyNode sound no more. Call it before its skeleton is removed from the world."""
        self._objects.pop(_key(body), None)
        self._partners.pop(_key(body), None)

    def read(self, world):
        """Call it after world.step(). The poses are those before the step, to which DART's points belong."""
        result = world.getLastCollisionResult()  # its contacts live as long as it does
        rows = [row for contact in result.getContacts() if (row := self._row(contact, world.getTimeStep()))]
        poses = [pose for _, _, pose in self._objects.values()]
        step = {}
        if rows:
            objects, partners, points, impulses, normals, seconds, speeds = map(numpy.array, zip(*rows))
            step["contacts"] = carillon.Contacts(objects, points, impulses, partners=partners, second_objects=seconds,
                                                 second_points=points, normals=normals, travel_speeds=speeds,
                                                 **self._settings)
        if poses:
            step["poses"] = carillon.Poses([handle for _, handle, _ in self._objects.values()],
                                           *map(numpy.array, zip(*poses)))
        for item in self._objects.values():
            item[2] = _pose(item[0])
        return step

    def _row(self, contact, step_s):
        """The force acts on the first body. Of two bodies that sound, the one with the lower handle is the object."""
        bodies = [_body(contact.collisionObject1), _body(contact.collisionObject2)]
        impulse = numpy.array(contact.force) * step_s
        handles = [self._objects[key][1] if (key := _key(body)) in self._objects else 0 for body in bodies]
        if not any(handles) or not impulse.any():
            return None
        if not handles[0] or 0 < handles[1] < handles[0]:
            bodies, handles, impulse = bodies[::-1], handles[::-1], -impulse
        point, normal = numpy.array(contact.point), numpy.array(contact.normal)
        return (handles[0], self._partner(_key(bodies[1])), point, impulse, normal, handles[1],
                _travel_speed(bodies, point, normal))

    def _partner(self, key):
        if key not in self._partners:
            self._partners[key] = self._partner_count
            self._partner_count += 1
        return self._partners[key]


def _body(collision_object):
    return collision_object.getShapeFrame().asShapeNode().getBodyNodePtr()


def _key(body):
    return body.getSkeleton().getName(), body.getName()


def _pose(body):
    """A position, and a quaternion w, x, y, z."""
    place = body.getWorldTransform()
    turn = place.quaternion()
    return place.translation().ravel(), [turn.w(), turn.x(), turn.y(), turn.z()]


def _travel_speed(bodies, point, normal):
    """In a slide that of one surface over the other; in a roll that of the point of contact, which moves at omega R
    over a body whose centre of mass is at the distance R."""
    arms = [point - body.getCOM().ravel() for body in bodies]
    turns = [body.getAngularVelocity().ravel() for body in bodies]
    slips = [body.getCOMLinearVelocity().ravel() + numpy.cross(turn, arm)
             for body, turn, arm in zip(bodies, turns, arms)]
    lever = max(abs(arm @ normal) if body.isReactive() else 0 for body, arm in zip(bodies, arms))

    def across(one, other):
        difference = one - other
        return numpy.linalg.norm(difference - normal * (difference @ normal))

    return across(*slips) + across(*turns) * lever
