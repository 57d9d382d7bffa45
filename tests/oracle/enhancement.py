"""Writes enhancement.csv: one small picture and what OpenCV, scikit-image and SciPy make of it.

python enhancement.py > enhancement.csv, with numpy, scipy, opencv-python-headless and scikit-image. Borders are reflected where the program can
do it (OpenCV's BORDER_REFLECT, SciPy's "reflect"); README.md says which pixels are compared where it cannot.
"""

import sys

import cv2
import numpy as np
import scipy.ndimage as ndi
import scipy.signal
from skimage.filters import unsharp_mask
from skimage.restoration import denoise_nl_means, denoise_tv_chambolle, richardson_lucy, wiener

ROWS, COLUMNS = 40, 48
rng = np.random.default_rng(18)

r, c = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
picture = 20.0 + 0.5 * r + 8.0 * np.sin(c / 7.0) + 30.0 * (np.hypot(r - 18, c - 22) < 9) + 15.0 * (c > 38)
picture = np.round(picture + rng.normal(0.0, 2.0, picture.shape), 3)
small = np.ascontiguousarray(picture[::2, ::2])
levels = np.clip(np.round((picture - picture.min()) / (picture.max() - picture.min()) * 255), 0, 255).astype(np.uint8)
psf = np.array([[1, 2, 1, 0, 0], [2, 6, 4, 1, 0], [1, 5, 9, 4, 1], [0, 2, 4, 3, 1], [0, 0, 1, 1, 1]], float)
psf /= psf.sum()

flat = picture - picture.mean()
mirrored = np.block([[flat, flat[:, ::-1]], [flat[::-1], flat[::-1, ::-1]]])
delta = np.zeros((3, 3))
delta[1, 1] = 1.0
deconvolved = wiener(mirrored, psf, 0.05, reg=delta, clip=False)[:ROWS, :COLUMNS] + picture.mean()

f32 = picture.astype(np.float32)
columns = {
    "picture": picture,
    "median_3": ndi.median_filter(picture, 3),
    "median_9": ndi.median_filter(picture, 9),
    "median_5_opencv": cv2.medianBlur(f32, 5),
    "wiener_5_noise_2": scipy.signal.wiener(picture, 5, 4.0),
    "wiener_3_noise_1": scipy.signal.wiener(picture, 3, 1.0),
    "bilateral_2_6_9": cv2.bilateralFilter(f32, 9, 6.0, 2.0, borderType=cv2.BORDER_REFLECT),
    "nl_means_3_5_6": denoise_nl_means(picture, 5, 6, 3.0, fast_mode=False, preserve_range=True),
    "nl_means_3_5_6_noise_1": denoise_nl_means(picture, 5, 6, 3.0, fast_mode=False, sigma=1.0, preserve_range=True),
    "tv_3": denoise_tv_chambolle(picture, 3.0, eps=0.0, max_num_iter=20000),
    "gaussian_1.5": ndi.gaussian_filter(picture, 1.5),
    "unsharp_1.5_0.8": unsharp_mask(picture, radius=1.5, amount=0.8, preserve_range=True),
    "laplacian": ndi.laplace(picture),
    "laplacian_opencv": cv2.Laplacian(picture, cv2.CV_64F, ksize=1, borderType=cv2.BORDER_REFLECT),
    "sobel_down": cv2.Sobel(picture, cv2.CV_64F, 0, 1, ksize=3, scale=0.125, borderType=cv2.BORDER_REFLECT),
    "sobel_across": cv2.Sobel(picture, cv2.CV_64F, 1, 0, ksize=3, scale=0.125, borderType=cv2.BORDER_REFLECT),
    "levels": levels,
    "equalize_levels": cv2.equalizeHist(levels),
    "clahe_levels_1000_4": cv2.createCLAHE(clipLimit=1000.0, tileGridSize=(4, 4)).apply(levels),
    "clahe_levels_2_4": cv2.createCLAHE(clipLimit=2.0, tileGridSize=(4, 4)).apply(levels),
    "clahe_levels_8_2": cv2.createCLAHE(clipLimit=8.0, tileGridSize=(2, 2)).apply(levels),
    "bilinear_2": cv2.resize(small, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR),
    "bicubic_2": cv2.resize(small, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC),
    "lanczos_2": cv2.resize(small, None, fx=2, fy=2, interpolation=cv2.INTER_LANCZOS4),
    "wiener_deconvolution": deconvolved,
    "richardson_lucy_4": richardson_lucy(picture, psf, num_iter=4, clip=False),
}

names = list(columns)
sys.stdout.write("row,column," + ",".join(names) + "\n")
for i in range(ROWS):
    for j in range(COLUMNS):
        sys.stdout.write(f"{i},{j}," + ",".join(f"{float(columns[n][i, j]):.10g}" for n in names) + "\n")
