# SPDX-License-Identifier: Apache-2.0
"""The box of drops.js, which falls on a floor in DART and slides."""

import pathlib
import sys

import dartpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "client_sdk/adapters"))
from dart_contacts import DartContacts  # noqa: E402

MASS_KG, HALF_M = 1.21, (0.1, 0.07, 0.03)
HEIGHT_M, SPEED_M_PER_S = 0.3, (0.5, 0, 0)
FRICTION, GRAVITY_M_PER_S2 = 0.5, 9.81


class DartDrop:
    def __init__(self, step_s, orientation=(1, 0, 0, 0)):
        self.world = dartpy.simulation.World()
        self.world.setTimeStep(step_s)
        self.world.setGravity([0, 0, -GRAVITY_M_PER_S2])
        # The default, FCL, also has contacts between the corners.
        self.world.getConstraintSolver().setCollisionDetector(dartpy.collision.DARTCollisionDetector())
        self._add("floor", (10, 10, 0.5), (0, 0, -0.5), (1, 0, 0, 0),
                  dartpy.dynamics.Skeleton.createWeldJointAndBodyNodePair)
        self.body = self._add("box", HALF_M, (0, 0, HEIGHT_M), orientation,
                              dartpy.dynamics.Skeleton.createFreeJointAndBodyNodePair)
        self.body.getSkeleton().setVelocities([0, 0, 0, *SPEED_M_PER_S])
        self.contacts = DartContacts()
        self.contacts.add_object(self.body, 1)

    def _add(self, name, half_m, position_m, orientation, create):
        skeleton = dartpy.dynamics.Skeleton(name)
        joint, body = create(skeleton)
        shape = dartpy.dynamics.BoxShape([2 * half for half in half_m])
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        node.createDynamicsAspect().setFrictionCoeff(FRICTION)
        body.setInertia(dartpy.dynamics.Inertia(MASS_KG, [0, 0, 0], shape.computeInertia(MASS_KG)))
        place = dartpy.math.Isometry3()
        place.set_quaternion(dartpy.math.Quaternion(*orientation))
        place.set_translation(position_m)
        joint.setTransformFromParentBodyNode(place)
        self.world.addSkeleton(skeleton)
        return body

    def step(self):
        """What a step of a stream or trace takes."""
        self.world.step()
        return self.contacts.read(self.world)

    def momentum(self):
        return MASS_KG * self.body.getCOMLinearVelocity().ravel()
