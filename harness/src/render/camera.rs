//! The camera: from a pixel to a ray.

use glam::DVec3;
use raykern::Ray;

/// A pinhole camera with an image plane in front of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole.
    pub position: DVec3,
    /// The image plane's axes: right, up, and away from the scene; unit vectors.
    axes: [DVec3; 3],
    /// Left, right, bottom and top of the image, on the plane.
    plane: [f64; 4],
    /// The plane's distance.
    distance: f64,
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// The picture's file name, if the scene gives one.
    pub image_name: String,
}

/// Why a camera cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CameraError {
    /// Nowhere to look.
    #[error("the direction of gaze is zero or not finite")]
    Gaze,
    /// Up is along the gaze.
    #[error("`Up` is zero, not finite or along the direction of gaze")]
    Up,
    /// No area to look through.
    #[error("the near plane must have finite left < right and bottom < top, and a distance > 0")]
    Plane,
    /// No or too many pixels.
    #[error("the image must be 1 to 32768 pixels wide and high")]
    Resolution,
    /// Not an angle of view.
    #[error("the field of view must be between 0 and 180 degrees")]
    FieldOfView,
}

impl Camera {
    /// The camera at `position` that looks along `gaze` through `plane` = left, right, bottom,
    /// top at `distance`. `up` need not be perpendicular to `gaze`.
    pub fn new(
        position: DVec3,
        gaze: DVec3,
        up: DVec3,
        plane: [f64; 4],
        distance: f64,
        resolution: [u32; 2],
    ) -> Result<Self, CameraError> {
        let back = (-gaze).try_normalize().ok_or(CameraError::Gaze)?;
        let right = up.cross(back).try_normalize().ok_or(CameraError::Up)?;
        let [left, right_end, bottom, top] = plane;
        let area = plane.iter().all(|x| x.is_finite()) && left < right_end && bottom < top;
        if !area || !distance.is_finite() || distance <= 0.0 {
            return Err(CameraError::Plane);
        }
        let camera = Camera {
            position,
            axes: [right, back.cross(right), back],
            plane,
            distance,
            resolution: [1, 1],
            image_name: String::new(),
        };
        camera.with_resolution(resolution)
    }

    /// The camera that looks from `position` at `target` with the vertical angle `fov_y` in
    /// degrees.
    pub fn look_at(
        position: DVec3,
        target: DVec3,
        up: DVec3,
        fov_y: f64,
        distance: f64,
        resolution: [u32; 2],
    ) -> Result<Self, CameraError> {
        if !(fov_y > 0.0 && fov_y < 180.0) {
            return Err(CameraError::FieldOfView);
        }
        let [width, height] = resolution.map(f64::from);
        let top = distance * (0.5 * fov_y.to_radians()).tan();
        let right = top * width / height;
        Self::new(position, target - position, up, [-right, right, -top, top], distance, resolution)
    }

    /// The same view in another number of pixels.
    pub fn with_resolution(&self, resolution: [u32; 2]) -> Result<Self, CameraError> {
        if resolution.iter().any(|n| !(1..=32768).contains(n)) {
            return Err(CameraError::Resolution);
        }
        Ok(Camera { resolution, ..self.clone() })
    }

    /// The number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.resolution[0] as usize * self.resolution[1] as usize
    }

    /// The ray through the centre of pixel (`i`, `j`), `j` counted from the top.
    ///
    /// Computed in f64 and rounded once. The direction has about length one, so that `t` is a
    /// distance.
    pub fn ray(&self, i: u32, j: u32) -> Ray {
        let [left, right, bottom, top] = self.plane;
        let [width, height] = self.resolution.map(f64::from);
        let x = left + (f64::from(i) + 0.5) * (right - left) / width;
        let y = top - (f64::from(j) + 0.5) * (top - bottom) / height;
        let [u, v, w] = self.axes;
        let direction = (x * u + y * v - self.distance * w).normalize();
        Ray::new(self.position.as_vec3().to_array(), direction.as_vec3().to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn front(resolution: [u32; 2]) -> Camera {
        let plane = [-1.0, 1.0, -0.5, 0.5];
        Camera::new(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, plane, 2.0, resolution).unwrap()
    }

    #[test]
    fn pixels_run_from_the_upper_left() {
        let corner = DVec3::new(-1.0 + 0.25, 0.5 - 0.25, -2.0).normalize();
        assert_eq!(front([4, 2]).ray(0, 0).direction, corner.as_vec3().to_array());
        let corner = DVec3::new(1.0 - 0.25, -0.5 + 0.25, -2.0).normalize();
        assert_eq!(front([4, 2]).ray(3, 1).direction, corner.as_vec3().to_array());
    }

    #[test]
    fn both_forms_describe_the_same_camera() {
        let [eye, target] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 1.0)];
        let top = 3.0 * (16.0f64).to_radians().tan();
        let plane = [-2.0 * top, 2.0 * top, -top, top];
        let a = Camera::look_at(eye, target, DVec3::Z, 32.0, 3.0, [200, 100]).unwrap();
        let b = Camera::new(eye, target - eye, DVec3::Z, plane, 3.0, [200, 100]).unwrap();
        for (i, j) in [(0, 0), (199, 99), (17, 80)] {
            assert_eq!(a.ray(i, j), b.ray(i, j));
        }
    }

    #[test]
    fn bad_cameras_are_refused() {
        let make = |gaze, up, plane, size| {
            Camera::new(DVec3::ZERO, gaze, up, plane, 1.0, size).map(|_| ()).unwrap_err()
        };
        let plane = [-1.0, 1.0, -1.0, 1.0];
        assert_eq!(make(DVec3::ZERO, DVec3::Y, plane, [1, 1]), CameraError::Gaze);
        assert_eq!(make(DVec3::Y, DVec3::Y, plane, [1, 1]), CameraError::Up);
        assert_eq!(make(DVec3::X, DVec3::Y, [1.0; 4], [1, 1]), CameraError::Plane);
        assert_eq!(make(DVec3::X, DVec3::Y, plane, [0, 1]), CameraError::Resolution);
    }
}
