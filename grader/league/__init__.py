"""Run handed-in cases on a held-back pool: do they convict broken packages, and leave right ones alone?"""
