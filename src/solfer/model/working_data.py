"""Memory in which Pinocchio computes, also for robots with hundreds of DoFs."""

import numpy as np
import pinocchio as pin


def working_data(model: pin.Model) -> pin.Data:
    """Make the data of a model with one DoF a joint, n of them.

    Pinocchio's `Data` of a model contains four tensors of n^3 numbers for second derivatives: 4 GB at 500 DoFs. A model
    of 100 DoFs or more, where its fields take 140 MB, gets only what the kinematics, the inertia matrix and the bias
    force need, which is n^2 numbers; nothing else must be computed in it.
    """
    return model.createData() if model.nv < 100 else _small_data(model)


def _small_data(model: pin.Model) -> pin.Data:
    data = pin.Data()
    bodies = model.njoints
    size = model.nv
    for joint in model.joints:
        data.joints.append(joint.createData())
    for poses, count in ((data.oMi, bodies), (data.liMi, bodies), (data.oMf, model.nframes)):
        poses.extend([pin.SE3.Identity()] * count)
    for motions in (data.v, data.a, data.a_gf, data.ov, data.oa, data.oa_gf):
        motions.extend([pin.Motion.Zero()] * bodies)
    for forces in (data.f, data.h, data.of, data.oh):
        forces.extend([pin.Force.Zero()] * bodies)
    for inertias in (data.Ycrb, data.oYcrb):
        inertias.extend([pin.Inertia.Zero()] * bodies)
    for vectors in (data.com, data.vcom, data.acom):
        vectors.extend([np.zeros(3)] * bodies)
    data.mass.extend([0.0] * bodies)
    data.J = np.zeros((6, size))
    data.dJ = np.zeros((6, size))
    data.Ag = np.zeros((6, size))
    data.Jcom = np.zeros((3, size))
    data.M = np.zeros((size, size))
    data.nle = np.zeros(size)
    data.tau = np.zeros(size)
    data.g = np.zeros(size)
    _index(model, data)
    return data


def _index(model: pin.Model, data: pin.Data) -> None:
    """Write what Pinocchio looks up about the tree; joint k + 1 moves DoF k."""
    parents = list(model.parents)
    size = model.nv
    last = list(range(size + 1))
    for joint in range(size, 0, -1):
        last[parents[joint]] = max(last[parents[joint]], last[joint])
    above = [parent - 1 for parent in parents[1:]]
    data.lastChild.extend(last)
    data.nvSubtree.extend([last[joint] - joint + 1 for joint in range(size + 1)])
    data.nvSubtree_fromRow.extend([last[joint] - joint + 1 for joint in range(1, size + 1)])
    for rows in (data.parents_fromRow, data.non_mimic_parents_fromRow):
        rows.extend(above)
    data.mimic_parents_fromRow.extend([-1] * size)
    for rows in (data.idx_vExtended_to_idx_v_fromRow, data.start_idx_v_fromRow, data.end_idx_v_fromRow):
        rows.extend(range(size))
