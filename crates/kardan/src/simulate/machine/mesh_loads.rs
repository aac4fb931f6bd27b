//! Accelerations with the losses of teeth, and what teeth at rest hold.

use super::Machine;
use super::meshes::{Doubt, Meshes, doubt};
use crate::num::dot;
use crate::simulate::friction::Mode;

impl Machine {
    /// Accelerations and holding torques in the current modes with the losses of meshes, which `force` then has; and what meshes at rest hold.
    /// Needs the factors of what holds.
    pub(super) fn load_meshes(&mut self) {
        let mut meshes = std::mem::take(&mut self.meshes);
        self.unload(&mut meshes);
        self.accelerate_held();
        self.read_loads(&mut meshes);
        meshes.give(self.work.values());
        (meshes.doubt, meshes.undefined) = (None, None);
        meshes.sliding.clear();
        for (mesh, &k) in meshes.directions.iter().enumerate().filter(|(_, k)| self.modes[**k] != Mode::Stick) {
            meshes.sliding.push((mesh, self.modes[k].sign()));
        }
        if !meshes.sliding.is_empty() {
            meshes.base.clone_from(&meshes.loads);
            for place in 0..meshes.sliding.len() {
                let mesh = meshes.sliding[place].0;
                self.find_influence(&mut meshes, mesh);
            }
            let solved = meshes.solve();
            doubt(&mut meshes, solved);
            for &(mesh, _) in &meshes.sliding {
                self.act(meshes.directions[mesh], -meshes.torques[mesh]);
            }
            self.accelerate_held();
            self.read_loads(&mut meshes);
        }
        self.bound_meshes(&mut meshes);
        self.meshes = meshes;
    }

    /// Takes the losses of meshes out of the force.
    fn unload(&mut self, meshes: &mut Meshes) {
        for (&k, torque) in meshes.directions.iter().zip(&mut meshes.torques) {
            self.act(k, std::mem::take(torque));
        }
    }

    /// Adds a torque along a direction to the force.
    pub(super) fn act(&mut self, direction: usize, torque: f64) {
        if torque != 0.0 {
            let r = self.degrees_of_freedom;
            let row = &self.work.friction_rows[direction * r..(direction + 1) * r];
            self.force.iter_mut().zip(row).for_each(|(force, x)| *force += x * torque);
        }
    }

    /// What meshes carry with the accelerations, and with what holds and slides.
    fn read_loads(&self, meshes: &mut Meshes) {
        let held = self.holding.iter().copied().zip(self.hold_torque.iter().copied());
        self.read_loads_of(meshes, held);
    }

    /// The same with other torques that hold.
    pub(super) fn read_loads_of(&self, meshes: &mut Meshes, held: impl Iterator<Item = (usize, f64)> + Clone) {
        let r = self.degrees_of_freedom;
        let of = |place: usize| self.work.more(&self.dynamics, place);
        let directions = self.kept.end;
        for mesh in 0..meshes.directions.len() {
            let first = self.places.mesh_by_acceleration.start + mesh * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * self.acceleration[i]).sum();
            let first = self.places.mesh_by_torque.start + mesh * directions;
            let all = held.clone().chain(meshes.losses()).chain(meshes.rubbing.iter().copied());
            let rubbed: f64 = all.map(|(k, torque)| of(first + k) * torque).sum();
            meshes.loads[mesh] = of(self.places.mesh_loads.start + mesh) + moved + rubbed;
        }
    }

    /// What one of the loss of a sliding mesh does to what all carry.
    fn find_influence(&mut self, meshes: &mut Meshes, mesh: usize) {
        let (r, count, holding) = (self.degrees_of_freedom, meshes.directions.len(), self.holding.len());
        let direction = meshes.directions[mesh];
        let Meshes { change, held, influence, .. } = meshes;
        change.clear();
        change.extend(self.work.friction_rows[direction * r..(direction + 1) * r].iter().map(|x| -x));
        held.clear();
        if holding == r {
            held.extend((0..holding).map(|a| dot(&self.weighted[a * r..(a + 1) * r], change)));
            self.hold_factor.solve(held);
            change.fill(0.0);
        } else {
            self.work.factor.solve(change);
            held.extend(self.holding.iter().map(|&k| self.dynamics.along_friction(k, change, &self.work)));
            self.hold_factor.solve(held);
            for (a, torque) in held.iter().enumerate() {
                let row = &self.weighted[a * r..(a + 1) * r];
                change.iter_mut().zip(row).for_each(|(x, weight)| *x -= weight * torque);
            }
        }
        let of = |place: usize| self.work.more(&self.dynamics, place);
        for row in 0..count {
            let first = self.places.mesh_by_acceleration.start + row * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * change[i]).sum();
            let first = self.places.mesh_by_torque.start + row * self.kept.end;
            let holds: f64 = self.holding.iter().zip(&*held).map(|(k, torque)| of(first + k) * torque).sum();
            influence[row * count + mesh] = moved + holds + of(first + direction);
        }
    }

    /// What meshes hold either way at what they carry.
    pub(super) fn bound_meshes(&mut self, meshes: &mut Meshes) {
        meshes.negative = None;
        // Against motion forward, then backward; the first body drives where the torque of the teeth opposes the motion.
        for (bounds, sense) in self.bounds.iter_mut().zip([1.0, -1.0]) {
            meshes.evaluate(|_, load| load * sense <= 0.0);
            for (&k, loss) in meshes.directions.iter().zip(&meshes.losses) {
                bounds[k] = loss.max(0.0);
                if *loss < meshes.negative.map_or(0.0, |(_, least)| least) {
                    meshes.negative = Some((k, *loss));
                }
                if !loss.is_finite() {
                    meshes.undefined = Some(k);
                }
            }
        }
    }

    /// Teeth that the inertia of their load would lock at a state, as they slide and nothing holds: the loss grows by more than the torque that makes it.
    /// None beside rows that are kept.
    pub(in crate::simulate) fn locking_meshes(&mut self, state: &[f64]) -> Vec<usize> {
        if self.meshes.is_empty() || !self.kept.is_empty() || !self.forces(0.0, state) {
            return Vec::new();
        }
        let mut meshes = std::mem::take(&mut self.meshes);
        meshes.give(self.work.values());
        self.holding.clear();
        let count = meshes.directions.len();
        (0..count).for_each(|mesh| self.find_influence(&mut meshes, mesh));
        meshes.loads.fill(0.0);
        meshes.evaluate(|_, _| false);
        let locks = |mesh: &usize| meshes.slopes[*mesh] * meshes.influence[mesh * count + mesh] >= 1.0;
        let found = (0..count).filter(locks).map(|mesh| meshes.directions[mesh]).collect();
        self.meshes = meshes;
        found
    }

    /// Whether there are teeth that rub.
    pub(in crate::simulate) fn has_meshes(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// The direction of teeth that could go on in two ways from the point last evaluated.
    pub(in crate::simulate) fn doubtful_mesh(&self) -> Option<usize> {
        self.meshes.doubt.filter(|(_, doubt)| *doubt == Doubt::Two).map(|(direction, _)| direction)
    }

    /// The direction of teeth that had no motion where a rate was asked for, since that was forgotten.
    pub(in crate::simulate) fn lost_mesh(&self) -> Option<usize> {
        self.meshes.lost
    }

    /// Forgets it.
    pub(in crate::simulate) fn forget_lost_mesh(&mut self) {
        self.meshes.lost = None;
    }
}
